// SPDX-License-Identifier: Apache-2.0
// NIfTI-1 of one volume, packed by gzip, read by hand.
import zlib from "node:zlib";

export interface Nifti {
  readonly size: number[];
  readonly components: number;
  readonly datatype: number;
  /** Three rows of four, RAS, by the sform, and the same by the qform. */
  readonly sform: number[][];
  readonly qform: number[][];
  /** Bytes of the voxels. */
  readonly data: Buffer;
}

export function readNifti(packed: Buffer): Nifti {
  const bytes = zlib.gunzipSync(packed), f32 = (at: number, count: number) => Array.from({ length: count }, (_, i) => bytes.readFloatLE(at + 4 * i));
  if (bytes.readInt32LE(0) !== 348 || bytes.toString("latin1", 344, 348) !== "n+1\0") throw new Error("no NIfTI-1");
  const dim = Array.from({ length: 8 }, (_, i) => bytes.readInt16LE(40 + 2 * i)), [side, ...spacing] = f32(76, 4);
  const [b, c, d, ...offset] = f32(256, 6) as [number, number, number, number, number, number], a = Math.sqrt(Math.max(0, 1 - b * b - c * c - d * d));
  const turn = [
    [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
    [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
    [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - c * c - b * b],
  ];
  if (bytes.readInt16LE(252) < 1 || bytes.readInt16LE(254) < 1 || (bytes[123]! & 7) !== 2) throw new Error("a NIfTI-1 that does not say where it lies, in mm");
  const rows = f32(280, 12);
  return {
    size: dim.slice(1, 4), components: dim[0]! >= 5 ? dim[5]! : 1, datatype: bytes.readInt16LE(70), data: bytes.subarray(bytes.readFloatLE(108)),
    sform: [0, 4, 8].map((at) => rows.slice(at, at + 4)),
    qform: turn.map((row, at) => [...row.map((value, axis) => value * spacing[axis]! * (axis === 2 ? (side! < 0 ? -1 : 1) : 1)), offset[at]!]),
  };
}
