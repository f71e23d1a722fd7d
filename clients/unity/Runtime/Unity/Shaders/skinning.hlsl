// SPDX-License-Identifier: Apache-2.0
// Skinning at the client, HLSL (shader model 5): skinning.glsl as a compute shader, for engines whose meshes take a raw buffer.
// docs/reference/protocol.md, "Skinning at the client".
//
// METHOD: 1 LBS, 2 DQS (Kavan08), 3 CoR (LeHodgins16); INFLUENCES: of each point. Define both.

struct Point {
  uint restXY;       // x in the low 16 bits, y in the high ones
  uint restZNormal;  // z; "oct16": u + 128 and v + 128, in 127ths, 0: none
  uint centreXY;
  uint centreZ;
};
struct Motion {
  float4 turn;   // quaternion x, y, z, w
  float4 place;  // where it takes the middle of the box at rest, mm, and 0
};
struct Hung {
  uint4 nodes;  // rows of points
  float4 shares;
};

StructuredBuffer<Point> points : register(t0);    // first the vertices, then the nodes
StructuredBuffer<uint> weights : register(t1);    // INFLUENCES a point: segment in the low 16 bits, weight in 65535ths in the high ones
StructuredBuffer<uint> hungRows : register(t2);   // a vertex: 0, or 1 + its row of `hung`
StructuredBuffer<Hung> hung : register(t3);
StructuredBuffer<Motion> motions : register(t4);  // a segment
RWStructuredBuffer<uint2> posed : register(u0);   // u16 x, y, z and normal, little-endian

cbuffer Pose : register(b0) {
  float restStep;   // mm, of the points' numbers
  float posedStep;  // mm, of the numbers that come out
  uint vertexCount;
};

float3 turned(float4 q, float3 v) {
  float3 t = 2.0 * cross(q.xyz, v);
  return v + q.w * t + cross(q.xyz, t);
}

// mm from the middle of the box at rest.
float3 rest(uint xy, uint z) {
  return (float3(xy & 65535u, xy >> 16, z & 65535u) - 32768.0) * restStep;
}

float4 dualOf(float4 q, float3 t) {
  return 0.5 * float4(q.w * t + cross(t, q.xyz), -dot(t, q.xyz));
}

// `normal` is carried along, of any length afterwards.
float3 skin(uint row, inout float3 normal) {
  Point p = points[row];
  float3 y = rest(p.restXY, p.restZNormal);
#if METHOD == 3
  float3 c = rest(p.centreXY, p.centreZ);
#else
  float3 c = y;
#endif
  float3 at = 0.0, x0 = 0.0, x1 = 0.0, x2 = 0.0;
  float4 real = 0.0, dual = 0.0;
  for (uint k = 0; k < INFLUENCES; ++k) {
    uint influence = weights[INFLUENCES * row + k];
    float w = (influence >> 16) / 65535.0;
    if (w == 0.0) break;
    Motion motion = motions[influence & 65535u];
    real += w * motion.turn;
#if METHOD == 2
    dual += w * dualOf(motion.turn, motion.place.xyz);
#else
    at += w * (turned(motion.turn, c) + motion.place.xyz);
#endif
#if METHOD == 1
    x0 += w * turned(motion.turn, float3(1, 0, 0));
    x1 += w * turned(motion.turn, float3(0, 1, 0));
    x2 += w * turned(motion.turn, float3(0, 0, 1));
#endif
  }
#if METHOD == 1
  // The cofactor of the blended matrix.
  normal = normal.x * cross(x1, x2) + normal.y * cross(x2, x0) + normal.z * cross(x0, x1);
  return at;
#else
  float size = length(real);
  // Such a blend has no direction: the heaviest segment's stands for it.
  if (size < 1e-3) {
    Motion motion = motions[weights[INFLUENCES * row] & 65535u];
    real = motion.turn;
    dual = dualOf(motion.turn, motion.place.xyz);
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

float2 folded(float2 uv) {
  return (1.0 - abs(uv.yx)) * float2(uv.x < 0.0 ? -1.0 : 1.0, uv.y < 0.0 ? -1.0 : 1.0);
}

float3 decodeNormal(uint code) {
  float2 uv = (float2(code & 255u, code >> 8) - 128.0) / 127.0;
  float3 n = float3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  if (n.z < 0.0) n.xy = folded(uv);
  return normalize(n);
}

uint encodeNormal(float3 n) {
  float sum = abs(n.x) + abs(n.y) + abs(n.z);
  if (!(sum > 0.0)) return 0u;
  float2 uv = n.xy / sum;
  if (n.z < 0.0) uv = folded(uv);
  uint2 code = uint2(uv * 127.0 + 128.5) & 255u;
  return code.x | code.y << 8;
}

// mm from the low corner of the posed box.
float3 skinVertex(uint vertex, inout float3 normal) {
  uint row = hungRows[vertex];
  if (row == 0u) return skin(vertex, normal);
  Hung h = hung[row - 1u];
  float3 still[4], at[4], unused = 0.0, sum = 0.0;
  for (uint c = 0; c < 4; ++c) {
    Point node = points[h.nodes[c]];
    still[c] = rest(node.restXY, node.restZNormal);
    at[c] = skin(h.nodes[c], unused);
    sum += h.shares[c] * at[c];
  }
  float3 e1 = at[1] - at[0], e2 = at[2] - at[0], e3 = at[3] - at[0];
  normal = dot(normal, still[1] - still[0]) * cross(e2, e3) + dot(normal, still[2] - still[0]) * cross(e3, e1)
    + dot(normal, still[3] - still[0]) * cross(e1, e2);
  return sum;
}

[numthreads(64, 1, 1)]
void main(uint3 id : SV_DispatchThreadID) {
  uint vertex = id.x;
  if (vertex >= vertexCount) return;
  uint code = points[vertex].restZNormal >> 16;
  float3 normal = decodeNormal(code);
  uint3 numbers = uint3(clamp(skinVertex(vertex, normal) / posedStep + 0.5, 0.0, 65535.0));
  if (code != 0u) code = encodeNormal(normal);
  posed[vertex] = uint2(numbers.x | numbers.y << 16, numbers.z | code << 16);
}
