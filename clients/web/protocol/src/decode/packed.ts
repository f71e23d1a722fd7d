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
  const low = [0, 0, 0], high = [0, 0, 0];
  for (let axis = 0; axis < 3; ++axis) {
    let least = Infinity, most = -Infinity;
    for (const positions of tissues) {
      for (let i = axis; i < positions.length; i += 3) {
        const value = positions[i];
        if (!(Math.abs(value) < Infinity)) throw new ProtocolError(`a position that is not finite: ${value}`);
        if (value < least) least = value;
        if (value > most) most = value;
      }
    }
    if (least <= most) [low[axis], high[axis]] = [least, most];
  }
  const extent = Math.max(...high.map((value, axis) => value - low[axis]));
  return { scale: extent > 0 ? extent / 65535 : 1, offset: [low[0], low[1], low[2]] };
}

/** `positions`: f32, mm, 3 per vertex. */
export function packPositions(positions: Float32Array, quantisation: Quantisation, out: Uint16Array): void {
  const [x, y, z] = quantisation.offset, steps = 1 / quantisation.scale;
  for (let from = 0, to = 0; to < out.length; from += 3, to += STRIDE) {
    out[to] = Math.round((positions[from] - x) * steps);
    out[to + 1] = Math.round((positions[from + 1] - y) * steps);
    out[to + 2] = Math.round((positions[from + 2] - z) * steps);
  }
}
