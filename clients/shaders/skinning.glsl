// SPDX-License-Identifier: Apache-2.0
// Skinning at the client, GLSL ES 3.00: a vertex shader that turns a subscription to motions into posed vertices, for transform
// feedback (no rasteriser), or to be called from a shader that draws. docs/reference/protocol.md, "Skinning at the client".
//
// METHOD: 1 LBS, 2 DQS (Kavan08), 3 CoR (LeHodgins16); INFLUENCES: of each point. Both are written before this text.

precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;

uniform usampler2D points;   // RGBA16UI, 2 texels a point: x, y, z and normal at rest; x, y, z of its centre of rotation
uniform usampler2D weights;  // RG16UI, INFLUENCES texels a point: segment, weight in 65535ths
uniform usampler2D hung;     // R32UI, a texel a vertex: 0, or 1 + its row in the next two
uniform usampler2D hungNodes;   // RGBA32UI: rows of points
uniform sampler2D hungShares;   // RGBA32F
uniform sampler2D motions;   // RGBA32F, 2 texels a segment: quaternion x, y, z, w; where it takes the middle of the box at rest, mm
uniform float restStep;      // mm, of the points' numbers
uniform float posedStep;     // mm, of the numbers that come out

// x and y, z and normal: little-endian, just as u16 x, y, z, normal.
flat out uvec2 posed;

ivec2 texel(int row, ivec2 size) { return ivec2(row % size.x, row / size.x); }

vec3 turned(vec4 q, vec3 v) {
  vec3 t = 2.0 * cross(q.xyz, v);
  return v + q.w * t + cross(q.xyz, t);
}

// mm from the middle of the box at rest.
vec3 rest(uvec3 numbers) { return (vec3(numbers) - 32768.0) * restStep; }

// `normal` is carried along, of any length afterwards.
vec3 skin(int point, inout vec3 normal) {
  ivec2 pointsSize = textureSize(points, 0), weightsSize = textureSize(weights, 0), motionsSize = textureSize(motions, 0);
  vec3 y = rest(texelFetch(points, texel(2 * point, pointsSize), 0).xyz);
#if METHOD == 3
  vec3 c = rest(texelFetch(points, texel(2 * point + 1, pointsSize), 0).xyz);
#else
  vec3 c = y;
#endif
  vec3 at = vec3(0.0);
  vec4 real = vec4(0.0), dual = vec4(0.0);
  mat3 blend = mat3(0.0);
  for (int k = 0; k < INFLUENCES; ++k) {
    uvec2 influence = texelFetch(weights, texel(INFLUENCES * point + k, weightsSize), 0).xy;
    if (influence.y == 0u) break;
    float w = float(influence.y) / 65535.0;
    int segment = int(influence.x);
    vec4 q = texelFetch(motions, texel(2 * segment, motionsSize), 0);
    vec3 t = texelFetch(motions, texel(2 * segment + 1, motionsSize), 0).xyz;
    real += w * q;
#if METHOD == 2
    dual += (w * 0.5) * vec4(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
#else
    at += w * (turned(q, c) + t);
#endif
#if METHOD == 1
    blend += w * mat3(turned(q, vec3(1, 0, 0)), turned(q, vec3(0, 1, 0)), turned(q, vec3(0, 0, 1)));
#endif
  }
#if METHOD == 1
  // The cofactor of the blended matrix.
  normal = normal.x * cross(blend[1], blend[2]) + normal.y * cross(blend[2], blend[0]) + normal.z * cross(blend[0], blend[1]);
  return at;
#else
  float size = length(real);
  // Such a blend has no direction: the heaviest segment's stands for it.
  if (size < 1e-3) {
    int segment = int(texelFetch(weights, texel(INFLUENCES * point, weightsSize), 0).x);
    real = texelFetch(motions, texel(2 * segment, motionsSize), 0);
    vec3 t = texelFetch(motions, texel(2 * segment + 1, motionsSize), 0).xyz;
    dual = 0.5 * vec4(real.w * t + cross(t, real.xyz), -dot(t, real.xyz));
    size = 1.0;
  }
  real /= size;
  normal = turned(real, normal);
#if METHOD == 2
  dual /= size;
  return turned(real, y) + 2.0 * (real.w * dual.xyz - dual.w * real.xyz + cross(real.xyz, dual.xyz));
#else
  return at + turned(real, y - c);
#endif
#endif
}

// "oct16": u + 128 in the low byte and v + 128 in the high one, in 127ths; 0: none.
vec3 decodeNormal(uint code) {
  vec2 uv = (vec2(code & 255u, code >> 8) - 128.0) / 127.0;
  vec3 n = vec3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(uv.yx)) * vec2(uv.x < 0.0 ? -1.0 : 1.0, uv.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

uint encodeNormal(vec3 n) {
  float sum = abs(n.x) + abs(n.y) + abs(n.z);
  if (!(sum > 0.0)) return 0u;
  vec2 uv = n.xy / sum;
  if (n.z < 0.0) uv = (1.0 - abs(uv.yx)) * vec2(uv.x < 0.0 ? -1.0 : 1.0, uv.y < 0.0 ? -1.0 : 1.0);
  uvec2 code = uvec2(uv * 127.0 + 128.5) & 255u;
  return code.x | code.y << 8;
}

// mm from the low corner of the posed box.
vec3 skinVertex(int vertex, inout vec3 normal) {
  uint row = texelFetch(hung, texel(vertex, textureSize(hung, 0)), 0).x;
  if (row == 0u) return skin(vertex, normal);
  uvec4 nodes = texelFetch(hungNodes, texel(int(row) - 1, textureSize(hungNodes, 0)), 0);
  vec4 shares = texelFetch(hungShares, texel(int(row) - 1, textureSize(hungShares, 0)), 0);
  vec3 still[4], at[4], unused = vec3(0.0), sum = vec3(0.0);
  for (int c = 0; c < 4; ++c) {
    still[c] = rest(texelFetch(points, texel(2 * int(nodes[c]), textureSize(points, 0)), 0).xyz);
    at[c] = skin(int(nodes[c]), unused);
    sum += shares[c] * at[c];
  }
  vec3 e1 = at[1] - at[0], e2 = at[2] - at[0], e3 = at[3] - at[0];
  normal = dot(normal, still[1] - still[0]) * cross(e2, e3) + dot(normal, still[2] - still[0]) * cross(e3, e1)
    + dot(normal, still[3] - still[0]) * cross(e1, e2);
  return sum;
}

void main() {
  uint code = texelFetch(points, texel(2 * gl_VertexID, textureSize(points, 0)), 0).w;
  vec3 normal = decodeNormal(code);
  uvec3 numbers = uvec3(clamp(skinVertex(gl_VertexID, normal) / posedStep + 0.5, 0.0, 65535.0));
  if (code != 0u) code = encodeNormal(normal);
  posed = uvec2(numbers.x | numbers.y << 16, numbers.z | code << 16);
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
