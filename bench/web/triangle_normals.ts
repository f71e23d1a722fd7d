// SPDX-License-Identifier: Apache-2.0
// The peer of normals that the server sends: each vertex' sum of its triangles' normals, by area, into the fourth number of packed
// vertices (clients/web/protocol/src/decode/packed.ts).
const STRIDE = 4;

/** `sums`: room for 3 numbers a vertex. */
export function triangleNormals(vertices: Uint16Array, indices: Uint32Array, sums: Float32Array): void {
  sums.fill(0);
  for (let i = 0; i < indices.length; i += 3) {
    const a = indices[i], b = indices[i + 1], c = indices[i + 2];
    const ax = vertices[STRIDE * a], ay = vertices[STRIDE * a + 1], az = vertices[STRIDE * a + 2];
    const ux = vertices[STRIDE * b] - ax, uy = vertices[STRIDE * b + 1] - ay, uz = vertices[STRIDE * b + 2] - az;
    const vx = vertices[STRIDE * c] - ax, vy = vertices[STRIDE * c + 1] - ay, vz = vertices[STRIDE * c + 2] - az;
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const corner of [3 * a, 3 * b, 3 * c]) {
      sums[corner] += x;
      sums[corner + 1] += y;
      sums[corner + 2] += z;
    }
  }
  for (let v = 0, at = 0; at < sums.length; ++v, at += 3) vertices[STRIDE * v + 3] = octahedral(sums[at], sums[at + 1], sums[at + 2]);
}

function octahedral(x: number, y: number, z: number): number {
  const length = Math.abs(x) + Math.abs(y) + Math.abs(z);
  if (length === 0) return 0;
  let u = x / length, v = y / length;
  if (z < 0) [u, v] = [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
  return (Math.round(127 * u) + 128) | ((Math.round(127 * v) + 128) << 8);
}
