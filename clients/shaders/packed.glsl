// SPDX-License-Identifier: Apache-2.0
// A vertex of 8 bytes as frames bring it, GLSL ES 3.00: a vertex shader that makes a position and a normal of it, for transform feedback,
// or to be called from a shader that draws. Such vertices are those of ecorche_client_copy_packed, of VertexLayout.Packed in C#, and of
// BodyFrame.vertices in TypeScript. docs/embedding.md, "Show a served body from C".

precision highp float;
precision highp int;

// x, y, z and the normal: an integer attribute, glVertexAttribIPointer(location, 4, GL_UNSIGNED_SHORT, 8, 0).
in uvec4 numbers;

uniform vec3 low;         // ecorche_packed.low; BodyFrame.Low, offset: where number 0 lies, LPS mm
uniform float numberStep;  // ecorche_packed.step; BodyFrame.Step, scale: mm from one number to the next

out vec3 position;  // LPS mm: for other axes multiply by ecorche_space_matrix
out vec3 normal;    // of length 1; 0 where none came

vec3 unpackPosition(uvec3 at) { return low + numberStep * vec3(at); }

// "oct16": u + 128 in the low byte and v + 128 in the high one, in 127ths (Meyer10); 0: none.
vec3 unpackNormal(uint code) {
  if (code == 0u) return vec3(0.0);
  // Whole numbers until the root, as the processor has them.
  ivec2 uv = ivec2(code & 255u, code >> 8u) - 128;
  ivec3 n = ivec3(uv, 127 - abs(uv.x) - abs(uv.y));
  if (n.z < 0) n.xy = (127 - abs(uv.yx)) * ivec2(uv.x < 0 ? -1 : 1, uv.y < 0 ? -1 : 1);
  return normalize(vec3(n));
}

void main() {
  position = unpackPosition(numbers.xyz);
  normal = unpackNormal(numbers.w);
  gl_Position = vec4(0.0, 0.0, 0.0, 1.0);
}
