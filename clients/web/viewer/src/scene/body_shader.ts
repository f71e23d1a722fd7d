// SPDX-License-Identifier: Apache-2.0
// GLSL of the body. A vertex is four integers: x, y and z, which the matrix of the group places, and an octahedral normal.
//
// Why integers: graphics cards read them as they are. Three u16 that become floats are no format of theirs, and the driver would
// convert the whole buffer after every frame, once for each tissue.

/** bodyPosition(): numbers of the present frame. */
export const VERTEX = /* glsl */ `
attribute uvec4 vertex;
vec3 bodyPosition() { return vec3(vertex.xyz); }
`;

/** "oct16": u + 128 in the low byte and v + 128 in the high one, in 127ths. */
const NORMAL = /* glsl */ `
vec3 bodyNormal() {
  vec2 uv = (vec2(vertex.w & 255u, vertex.w >> 8) - 128.0) / 127.0;
  vec3 normal = vec3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  if (normal.z < 0.0) {
    vec2 signs = vec2(uv.x < 0.0 ? -1.0 : 1.0, uv.y < 0.0 ? -1.0 : 1.0);
    normal.xy = (1.0 - abs(uv.yx)) * signs;
  }
  return normalize(normal);
}
`;

/** What a vertex is coloured by: a number of its own, or how far it is from where it was scanned, mm. */
const SCALAR = /* glsl */ `
#ifdef SCALAR_VALUES
attribute float value;
float scalar() { return value; }
#else
attribute uvec4 rest;
uniform vec4 restBox;   // low, step
uniform vec4 poseBox;
float scalar() { return length((bodyPosition() * poseBox.w + poseBox.xyz) - (vec3(rest.xyz) * restBox.w + restBox.xyz)); }
#endif
`;

/** 1 at the vertices of a cap, where the border of the scan cuts the body. Where it is 1 throughout, nothing is tissue. What else ends at that
 *  border lies in the same plane: the cap comes a little nearer along the line of sight, and hides it whole. */
const CAP = /* glsl */ `
#ifdef CAP
attribute float cap;
centroid varying float vCap;
vec4 nearer(vec4 mvPosition) { return vec4(mvPosition.xyz * (1.0 - 0.002 * cap), mvPosition.w); }
#endif
`;
const IS_CAP = /* glsl */ `
#ifdef CAP
centroid varying float vCap;
bool isCap() { return vCap > 0.999; }
#endif
`;

export const TISSUE_VERTEX = /* glsl */ `
#include <common>
${VERTEX}${NORMAL}${CAP}
#ifdef SCALAR
${SCALAR}
varying float vScalar;
#endif
centroid varying vec3 vNormal;
centroid varying vec3 vView;
#include <clipping_planes_pars_vertex>

void main() {
  vec4 mvPosition = modelViewMatrix * vec4(bodyPosition(), 1.0);
  vNormal = normalMatrix * bodyNormal();
  vView = mvPosition.xyz;
  #ifdef SCALAR
  vScalar = scalar();
  #endif
  #ifdef CAP
  vCap = cap;
  mvPosition = nearer(mvPosition);
  #endif
  gl_Position = projectionMatrix * mvPosition;
  #include <clipping_planes_vertex>
}
`;

// The studio: a sky and a floor, a warm key from above the viewer's left, a cool fill, and a rim from behind that parts the body from
// the ground. All but sky and floor go with the camera, so that no side of the body is ever dark.
export const TISSUE_FRAGMENT = /* glsl */ `
#include <common>
uniform vec3 color;
uniform vec3 scatter;
uniform float wrap;
uniform float roughness;
uniform float shine;
uniform float opacity;
uniform float glow;
uniform vec3 accent;
uniform vec3 capColor;
centroid varying vec3 vNormal;
centroid varying vec3 vView;
${IS_CAP}
#ifdef SCALAR
uniform vec2 scalarRange;
uniform bool scalarDiverges;
varying float vScalar;
// Blue below the middle, red above it, white between; what is below all is inside out.
vec3 divergingColor(float t) {
  if (t < 0.0) return vec3(0.55, 0.0, 0.55);
  t = clamp(t, 0.0, 1.0) * 2.0;
  return t < 1.0 ? mix(vec3(0.01, 0.06, 0.35), vec3(0.85), t) : mix(vec3(0.85), vec3(0.42, 0.01, 0.02), t - 1.0);
}
// Five stops of viridis, dark to light, so that the order survives without colour.
vec3 scalarColor(float t) {
  vec3 a = vec3(0.058, 0.0003, 0.088), b = vec3(0.046, 0.081, 0.259), c = vec3(0.014, 0.279, 0.263);
  vec3 d = vec3(0.117, 0.584, 0.124), e = vec3(0.984, 0.799, 0.018);
  t = clamp(t, 0.0, 1.0) * 4.0;
  return t < 1.0 ? mix(a, b, t) : t < 2.0 ? mix(b, c, t - 1.0) : t < 3.0 ? mix(c, d, t - 2.0) : mix(d, e, t - 3.0);
}
#endif
#include <clipping_planes_pars_fragment>

float wrapped(float cosine, float w) { return clamp((cosine + w) / (1.0 + w), 0.0, 1.0) / (1.0 + w); }

float highlight(vec3 n, vec3 v, vec3 l, float rough) {
  vec3 h = normalize(l + v);
  float a = rough * rough, a2 = a * a;
  float nh = max(dot(n, h), 0.0), nl = max(dot(n, l), 0.0), nv = max(dot(n, v), 1e-3), vh = max(dot(v, h), 0.0);
  float d = a2 / max(PI * pow(nh * nh * (a2 - 1.0) + 1.0, 2.0), 1e-4);
  float k = (rough + 1.0) * (rough + 1.0) / 8.0;
  float g = 1.0 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k)) / 4.0;
  return d * g * (0.04 + 0.96 * pow(1.0 - vh, 5.0)) * nl;
}

void main() {
  #include <clipping_planes_fragment>
  vec3 n = normalize(vNormal);
  vec3 v = normalize(-vView);
  bool inside = dot(n, v) < 0.0 && !gl_FrontFacing;
  if (inside) n = -n;
  float facing = clamp(dot(n, v), 0.0, 1.0);
  vec3 up = normalize((viewMatrix * vec4(0.0, 1.0, 0.0, 0.0)).xyz);

  vec3 base = color;
  #ifdef SCALAR
  float share = (vScalar - scalarRange.x) / max(scalarRange.y - scalarRange.x, 1e-6);
  base = scalarDiverges ? divergingColor(share) : scalarColor(share);
  #endif

  vec3 toKey = normalize(vec3(-0.45, 0.65, 0.75));
  vec3 toFill = normalize(vec3(0.8, 0.1, 0.55));
  vec3 toRim = normalize(vec3(0.35, 0.55, -0.75));
  const vec3 keyColor = vec3(1.0, 0.955, 0.9) * 2.35;
  const vec3 fillColor = vec3(0.78, 0.88, 1.0) * 0.5;
  const vec3 rimColor = vec3(0.9, 0.95, 1.0);
  float sky = 0.5 + 0.5 * dot(n, up);
  vec3 ambient = mix(vec3(0.235, 0.2, 0.185), vec3(0.58, 0.62, 0.68), sky * sky);

  // Where the light ends, what is below the surface shows: between the plain and the wrapped cosine.
  float keyPlain = max(dot(n, toKey), 0.0);
  float keyWrapped = wrapped(dot(n, toKey), wrap);
  vec3 keyTint = mix(scatter, vec3(1.0), smoothstep(0.0, 0.45, keyPlain + 0.12));
  vec3 diffuse = ambient + keyColor * keyWrapped * mix(keyTint, vec3(1.0), 1.0 - wrap) + fillColor * wrapped(dot(n, toFill), wrap);

  vec3 lit = base * diffuse * RECIPROCAL_PI * 1.65;
  lit += shine * (keyColor * highlight(n, v, toKey, roughness) + fillColor * highlight(n, v, toFill, roughness + 0.1)) * 0.9;
  float edge = pow(1.0 - facing, 3.0);
  lit += rimColor * edge * (0.12 + 0.55 * max(dot(n, toRim), 0.0)) * mix(base, vec3(1.0), 0.35);
  if (inside) lit *= 0.45;
  lit = mix(lit, accent, glow * (0.10 + 0.55 * edge));

  // Glass: what one looks through is clear where it faces the viewer and closes towards its outline.
  float alpha = opacity;
  #ifdef GLASS
  alpha = opacity + (1.0 - opacity) * 0.75 * pow(1.0 - facing, 2.2);
  alpha *= smoothstep(0.0, 0.04, opacity);
  #endif
  gl_FragColor = vec4(lit, alpha);
  #include <tonemapping_fragment>
  #ifdef CAP
  // No light and no number falls on what is not there; it is as strong wherever one looks from.
  if (isCap()) gl_FragColor = vec4(capColor, min(1.0, 2.4 * opacity));
  #endif
  #include <colorspace_fragment>
}
`;

/** The chosen tissue's outline: its back faces, moved out along the normal by `width` pixels. */
export const OUTLINE_VERTEX = /* glsl */ `
#include <common>
${VERTEX}${NORMAL}
uniform float width;
uniform vec2 viewport;
#include <clipping_planes_pars_vertex>
void main() {
  vec4 mvPosition = modelViewMatrix * vec4(bodyPosition(), 1.0);
  vec4 clip = projectionMatrix * mvPosition;
  vec3 normal = normalMatrix * bodyNormal();
  vec2 out2 = (projectionMatrix * vec4(normal, 0.0)).xy;
  clip.xy += normalize(out2 + vec2(1e-9)) * width * 2.0 / viewport * clip.w;
  gl_Position = clip;
  #include <clipping_planes_vertex>
}
`;

export const OUTLINE_FRAGMENT = /* glsl */ `
uniform vec3 accent;
#include <clipping_planes_pars_fragment>
void main() {
  #include <clipping_planes_fragment>
  gl_FragColor = vec4(accent, 1.0);
  #include <colorspace_fragment>
}
`;

/** Picking: the tissue's row, whether it is a cap there, and its scalar (a share of the range, or sixteenths of a millimetre from rest), and where the surface is, in one
 *  pixel of four u32. */
export const PICK_VERTEX = /* glsl */ `
${VERTEX}${CAP}#ifdef SCALAR
${SCALAR}
varying float vScalar;
#endif
uniform vec4 box;   // low and step, mm
varying vec3 vPlace;
#include <clipping_planes_pars_vertex>
void main() {
  vPlace = bodyPosition() * box.w + box.xyz;
  #ifdef SCALAR
  vScalar = scalar();
  #endif
  vec4 mvPosition = modelViewMatrix * vec4(bodyPosition(), 1.0);
  #ifdef CAP
  vCap = cap;
  mvPosition = nearer(mvPosition);
  #endif
  gl_Position = projectionMatrix * mvPosition;
  #include <clipping_planes_vertex>
}
`;

export const PICK_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
uniform uint tissue;
#ifdef SCALAR
uniform vec2 scalarRange;
varying float vScalar;
#endif
varying vec3 vPlace;
${IS_CAP}
layout(location = 0) out highp uvec4 picked;
#include <clipping_planes_pars_fragment>
void main() {
  #include <clipping_planes_fragment>
  uint scalar = 0u;
  #ifdef SCALAR_VALUES
  scalar = uint(clamp((vScalar - scalarRange.x) / (scalarRange.y - scalarRange.x), 0.0, 1.0) * 65535.0 + 0.5);
  #elif defined(SCALAR)
  scalar = uint(clamp(vScalar * 16.0, 0.0, 65535.0));
  #endif
  uint code = tissue + 1u;
  #ifdef CAP
  if (isCap()) code |= 0x8000u;
  #endif
  picked = uvec4(code | (scalar << 16), floatBitsToUint(vPlace.x), floatBitsToUint(vPlace.y), floatBitsToUint(vPlace.z));
}
`;

/** Depth alone. */
export const DEPTH_VERTEX = /* glsl */ `
${VERTEX}
#include <clipping_planes_pars_vertex>
void main() {
  vec4 mvPosition = modelViewMatrix * vec4(bodyPosition(), 1.0);
  gl_Position = projectionMatrix * mvPosition;
  #include <clipping_planes_vertex>
}
`;

export const DEPTH_FRAGMENT = /* glsl */ `
#include <clipping_planes_pars_fragment>
void main() {
  #include <clipping_planes_fragment>
  gl_FragColor = vec4(1.0);
}
`;
