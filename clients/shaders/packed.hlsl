// SPDX-License-Identifier: Apache-2.0
// A vertex of 8 bytes as frames bring it, HLSL (shader model 5): packed.glsl, as functions for a shader that draws, and a compute shader
// that makes six floats a vertex, for engines whose meshes take a raw buffer. docs/embedding.md, "Show a served body from C".

StructuredBuffer<uint2> vertices : register(t0);  // u16 x, y, z and normal, little-endian
struct Unpacked {
  float3 position;  // LPS mm: for other axes multiply by ecorche_space_matrix
  float3 normal;    // of length 1; 0 where none came
};
RWStructuredBuffer<Unpacked> unpacked : register(u0);

cbuffer Frame : register(b0) {
  float3 low;        // where number 0 lies, LPS mm
  float numberStep;  // mm from one number to the next
  uint vertexCount;
};

float3 unpackPosition(uint3 at) { return low + numberStep * float3(at); }

// "oct16": u + 128 in the low byte and v + 128 in the high one, in 127ths (Meyer10); 0: none.
float3 unpackNormal(uint code) {
  if (code == 0) return float3(0, 0, 0);
  // Whole numbers until the root, as the processor has them.
  int2 uv = int2(code & 255, code >> 8) - 128;
  int3 n = int3(uv, 127 - abs(uv.x) - abs(uv.y));
  if (n.z < 0) n.xy = (127 - abs(uv.yx)) * int2(uv.x < 0 ? -1 : 1, uv.y < 0 ? -1 : 1);
  return normalize(float3(n));
}

// Of an attribute R16G16B16A16_UINT; `numbers`: x, y, z and the normal.
Unpacked unpack(uint4 numbers) {
  Unpacked made;
  made.position = unpackPosition(numbers.xyz);
  made.normal = unpackNormal(numbers.w);
  return made;
}

[numthreads(64, 1, 1)]
void main(uint3 thread : SV_DispatchThreadID) {
  if (thread.x >= vertexCount) return;
  uint2 words = vertices[thread.x];
  unpacked[thread.x] = unpack(uint4(words.x & 0xFFFF, words.x >> 16, words.y & 0xFFFF, words.y >> 16));
}
