// SPDX-License-Identifier: Apache-2.0
// Vertices as they go to the GPU: u16 x, y, z and an octahedral normal in the fourth. position = offset + scale * number, mm, LPS.
//
// Why 8 bytes: strides must be multiples of 4 for Metal and WebGPU, and the fourth would be padding.
import { ProtocolError } from "../framing.js";

/** Numbers of 16 bits for one vertex. */
export const STRIDE = 4;
/** The fourth number of a vertex without a normal. Else its low byte is u + 128 and its high byte v + 128, in 127ths. */
export const NO_NORMAL = 0;

/** position = offset + scale * number on each axis. */
export interface Quantisation {
  scale: number;
  offset: [number, number, number];
}

/** `numbers`: 3 per vertex. */
export function packNumbers(numbers: Uint16Array, out: Uint16Array): void {
  for (let from = 0, to = 0; to < out.length; from += 3, to += STRIDE) {
    out[to] = numbers[from];
    out[to + 1] = numbers[from + 1];
    out[to + 2] = numbers[from + 2];
  }
}

/** `normals`: the protocol's oct16, 2 per vertex. Its (-128, -128) becomes NO_NORMAL. */
export function packNormals(normals: Int8Array, out: Uint16Array): void {
  for (let from = 0, to = 3; to < out.length; from += 2, to += STRIDE) {
    out[to] = (normals[from] + 128) | ((normals[from + 1] + 128) << 8);
  }
}

/** The smallest cube of 65535 steps that all of these positions lie in. */
export function quantisationOf(tissues: Float32Array[]): Quantisation {
  let lowX = Infinity, lowY = Infinity, lowZ = Infinity, highX = -Infinity, highY = -Infinity, highZ = -Infinity, sum = 0;
  for (const positions of tissues) {
    for (let i = 0; i < positions.length; i += 3) {
      const x = positions[i], y = positions[i + 1], z = positions[i + 2];
      if (x < lowX) lowX = x;
      if (x > highX) highX = x;
      if (y < lowY) lowY = y;
      if (y > highY) highY = y;
      if (z < lowZ) lowZ = z;
      if (z > highZ) highZ = z;
      sum += x - x + (y - y) + (z - z);  // 0, but for what is not finite
    }
  }
  if (sum !== 0) throw new ProtocolError("a position that is not finite");
  if (!(lowX <= highX)) return { scale: 1, offset: [0, 0, 0] };
  const extent = Math.max(highX - lowX, highY - lowY, highZ - lowZ);
  return { scale: extent > 0 ? extent / 65535 : 1, offset: [lowX, lowY, lowZ] };
}

/** `positions`: f32, mm, 3 per vertex, within the cube. */
export function packPositions(positions: Float32Array, quantisation: Quantisation, out: Uint16Array): void {
  const [x, y, z] = quantisation.offset, steps = 1 / quantisation.scale;
  for (let from = 0, to = 0; to < out.length; from += 3, to += STRIDE) {
    out[to] = (positions[from] - x) * steps + 0.5;
    out[to + 1] = (positions[from + 1] - y) * steps + 0.5;
    out[to + 2] = (positions[from + 2] - z) * steps + 0.5;
  }
}
