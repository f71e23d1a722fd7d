// SPDX-License-Identifier: Apache-2.0
// GLSL of the rays: through the texture of a volume from front to back, up to the nearest solid surface. Emission and absorption; each
// piece of a ray takes away as much as its length says, so that steps of another length give the same picture.

export const RAY_VERTEX = /* glsl */ `
out vec2 at;
void main() {
  at = position.xy;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}
`;

export const RAY_FRAGMENT = /* glsl */ `
precision highp float;
precision highp sampler3D;
uniform sampler3D volume;     // stored values
uniform sampler3D occupied;   // a texel for each block: can anything of it be seen?
uniform sampler2D transfer;   // colour, and opacity of a millimetre, along the window
uniform sampler2D depth;      // of solid surfaces
uniform mat4 fromClip;        // from the picture into the texture
uniform vec3 extent;          // mm along the texture's axes
uniform vec3 texels;
uniform vec4 plane;           // in the texture: what lies behind it is cut away
uniform vec2 window;          // place in the window = x * stored + y
uniform float stepMm;
uniform float density;        // times every opacity
uniform float shading;        // 0 to 1
in vec2 at;
layout(location = 0) out vec4 color;

const float BLOCK = 8.0;
const int MOST_STEPS = 4096;

vec3 unproject(float z) {
  vec4 point = fromClip * vec4(at, z, 1.0);
  return point.xyz / point.w;
}

float stored(vec3 p) { return texture(volume, p).r; }

// Along mm, of places in the window.
vec3 gradient(vec3 p) {
  vec3 e = 1.0 / texels;
  vec3 difference = vec3(
    stored(p + vec3(e.x, 0, 0)) - stored(p - vec3(e.x, 0, 0)),
    stored(p + vec3(0, e.y, 0)) - stored(p - vec3(0, e.y, 0)),
    stored(p + vec3(0, 0, e.z)) - stored(p - vec3(0, 0, e.z)));
  return window.x * difference / (2.0 * e * extent);
}

// Light from the eye, on the side of a border that one sees; where there is none, all is lit alike.
vec3 lit(vec3 base, vec3 p, vec3 ray) {
  vec3 slope = gradient(p);
  float steep = length(slope);
  if (steep < 1e-6) return base;
  float facing = abs(dot(slope / steep, ray));
  float share = shading * smoothstep(0.005, 0.06, steep);
  return base * mix(1.0, 0.28 + 0.72 * facing, share) + share * 0.12 * pow(facing, 24.0);
}

// mm to where the ray leaves the block that it is in.
float toBlockEnd(vec3 p, vec3 direction) {
  vec3 size = BLOCK / texels, block = floor(p / size);
  vec3 next = (block + step(0.0, direction)) * size;
  vec3 way = (next - p) / (mix(vec3(-1.0), vec3(1.0), step(0.0, direction)) * max(abs(direction), 1e-9));
  return min(min(way.x, way.y), way.z);
}

void main() {
  color = vec4(0.0);
  vec3 near = unproject(-1.0), far = unproject(2.0 * texture(depth, 0.5 * at + 0.5).r - 1.0);
  vec3 way = far - near;
  float all = length(way * extent);
  if (all <= 0.0) return;
  vec3 direction = way / all;   // of a millimetre
  vec3 safe = mix(vec3(-1.0), vec3(1.0), step(0.0, direction)) * max(abs(direction), 1e-12);
  vec3 one = (0.0 - near) / safe, other = (1.0 - near) / safe;
  vec3 least = min(one, other), most = max(one, other);
  float begin = max(max(max(least.x, least.y), least.z), 0.0), end = min(min(min(most.x, most.y), most.z), all);
  float towards = dot(plane.xyz, direction), from = dot(plane.xyz, near) + plane.w;
  if (abs(towards) < 1e-12) {
    if (from < 0.0) return;
  } else if (towards > 0.0) {
    begin = max(begin, -from / towards);
  } else {
    end = min(end, -from / towards);
  }
  vec3 ray = normalize(direction * extent);
  // Another place of the first step in every pixel: noise that the eye forgives, in place of rings.
  float piece = stepMm * (0.05 + 0.95 * fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715)))));
  float t = begin;
  for (int i = 0; i < MOST_STEPS && t < end && color.a < 0.985; ++i) {
    vec3 here = near + direction * t;
    if (texelFetch(occupied, ivec3(clamp(here * texels / BLOCK, vec3(0.0), vec3(textureSize(occupied, 0)) - 1.0)), 0).r < 0.5) {
      t += max(toBlockEnd(here, direction), 0.0) + 1e-3;
      continue;
    }
    float length = min(piece, end - t);
    vec3 p = near + direction * (t + 0.5 * length);
    vec4 seen = texture(transfer, vec2(window.x * stored(p) + window.y, 0.5));
    float opacity = 1.0 - pow(1.0 - min(density * seen.a, 0.999), length);
    if (opacity > 0.0) {
      vec3 light = opacity > 0.002 && shading > 0.0 ? lit(seen.rgb, p, ray) : seen.rgb;
      color += (1.0 - color.a) * opacity * vec4(light, 1.0);
    }
    t += length;
    piece = stepMm;
  }
}
`;

/** Lays the rays' picture over what is drawn already. */
export const OVER_FRAGMENT = /* glsl */ `
uniform sampler2D rays;
varying vec2 at;
void main() {
  vec4 seen = texture2D(rays, 0.5 * at + 0.5);
  if (seen.a <= 0.0) discard;
  gl_FragColor = vec4(seen.rgb / seen.a, 1.0);
  #include <colorspace_fragment>
  gl_FragColor = vec4(gl_FragColor.rgb * seen.a, seen.a);
}
`;
export const OVER_VERTEX = "varying vec2 at; void main() { at = position.xy; gl_Position = vec4(position.xy, 0.0, 1.0); }";
