// SPDX-License-Identifier: Apache-2.0
// A volume as NIfTI-1, packed by gzip as it is written. NIfTI's axes point right, anterior and up: x and y change their signs.
import type { KnownScalar, Numbers, VolumeGrid, VolumeImage } from "../../../protocol/src/index.js";
import { ScalarType } from "../../../protocol/src/index.js";

const HEADER = 348;
/** The header and four bytes that say that no extension follows. */
const OFFSET = 352;
const MM = 2;
const SCANNER = 1;
const VECTOR = 1007;
const CODES: Record<KnownScalar, number> = {
  [ScalarType.U8]: 2, [ScalarType.I16]: 4, [ScalarType.I32]: 8, [ScalarType.F32]: 16, [ScalarType.F64]: 64,
  [ScalarType.I8]: 256, [ScalarType.U16]: 512, [ScalarType.U32]: 768,
};
const CHUNK = 1 << 20;

/** Three rows of four: from voxels to mm, RAS. */
export function affineOf({ origin, spacing, direction }: VolumeGrid): number[][] {
  return [0, 1, 2].map((row) => {
    const sign = row < 2 ? -1 : 1;
    return [...[0, 1, 2].map((axis) => sign * direction[3 * row + axis]! * spacing[axis]!), sign * origin[row]!];
  });
}

/** Of a rotation, by rows; where it mirrors, the last axis is turned round and `side` says so. */
function quaternionOf(rows: number[][]): { b: number; c: number; d: number; side: number } {
  const r = rows.map((row) => [...row]);
  const det = r[0]![0]! * (r[1]![1]! * r[2]![2]! - r[1]![2]! * r[2]![1]!) - r[0]![1]! * (r[1]![0]! * r[2]![2]! - r[1]![2]! * r[2]![0]!)
    + r[0]![2]! * (r[1]![0]! * r[2]![1]! - r[1]![1]! * r[2]![0]!);
  const side = det < 0 ? -1 : 1;
  for (const row of r) row[2]! *= side;
  const at = (row: number, column: number) => r[row]![column]!;
  // Of four ways the one that divides by the most.
  const squares = [1 + at(0, 0) + at(1, 1) + at(2, 2), 1 + at(0, 0) - at(1, 1) - at(2, 2), 1 - at(0, 0) + at(1, 1) - at(2, 2), 1 - at(0, 0) - at(1, 1) + at(2, 2)];
  const largest = squares.indexOf(Math.max(...squares)), s = 2 * Math.sqrt(squares[largest]!);
  const [a, b, c, d] = [
    [s / 4, (at(2, 1) - at(1, 2)) / s, (at(0, 2) - at(2, 0)) / s, (at(1, 0) - at(0, 1)) / s],
    [(at(2, 1) - at(1, 2)) / s, s / 4, (at(0, 1) + at(1, 0)) / s, (at(0, 2) + at(2, 0)) / s],
    [(at(0, 2) - at(2, 0)) / s, (at(0, 1) + at(1, 0)) / s, s / 4, (at(1, 2) + at(2, 1)) / s],
    [(at(1, 0) - at(0, 1)) / s, (at(0, 2) + at(2, 0)) / s, (at(1, 2) + at(2, 1)) / s, s / 4],
  ][largest]! as [number, number, number, number];
  const sign = a < 0 ? -1 : 1;
  return { b: sign * b, c: sign * c, d: sign * d, side };
}

export function niftiHeader({ grid, type, components, voxels }: Pick<VolumeImage, "grid" | "type" | "components"> & { voxels: { BYTES_PER_ELEMENT: number } }): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(OFFSET), view = new DataView(bytes.buffer);
  const i16 = (at: number, value: number) => view.setInt16(at, value, true), f32 = (at: number, value: number) => view.setFloat32(at, value, true);
  if (grid.size.some((each) => each > 32767)) throw new Error(`${grid.size.join(" x ")} voxels are more than NIfTI-1 can tell (save a part by \`ecorche pose\`)`);
  view.setInt32(0, HEADER, true);
  // Components are the fifth axis, after a time of one.
  [components > 1 ? 5 : 3, ...grid.size, 1, components, 1, 1].forEach((value, at) => i16(40 + 2 * at, value));
  if (components > 1) i16(68, VECTOR);
  i16(70, CODES[type]);
  i16(72, 8 * voxels.BYTES_PER_ELEMENT);
  const affine = affineOf(grid);
  const { b, c, d, side } = quaternionOf([0, 1, 2].map((row) => [0, 1, 2].map((axis) => affine[row]![axis]! / grid.spacing[axis]!)));
  [side, ...grid.spacing, 1, 1, 1, 1].forEach((value, at) => f32(76 + 4 * at, value));
  f32(108, OFFSET);
  f32(112, 1);
  bytes[123] = MM;
  i16(252, SCANNER);
  i16(254, SCANNER);
  [b, c, d, ...affine.map((row) => row[3]!)].forEach((value, at) => f32(256 + 4 * at, value));
  affine.flat().forEach((value, at) => f32(280 + 4 * at, value));
  bytes.set([0x6e, 0x2b, 0x31, 0], 344);
  return bytes;
}

/** The voxels in NIfTI's order: one component after the other. */
function* chunks({ components, voxels }: VolumeImage): Generator<Numbers> {
  const count = voxels.length / components;
  for (let component = 0; component < components; ++component) {
    for (let first = 0; first < count; first += CHUNK) {
      const last = Math.min(count, first + CHUNK);
      if (components === 1) {
        yield voxels.subarray(first, last) as Numbers;
      } else {
        const part = new (voxels.constructor as new (length: number) => Numbers)(last - first);
        for (let at = first; at < last; ++at) part[at - first] = voxels[at * components + component]!;
        yield part;
      }
    }
  }
}

/** `progress`: 0 to 1. Rejects with the signal's reason. What is kept of it are the packed bytes alone. */
export async function writeNifti(image: VolumeImage, progress: (share: number) => void = () => {}, signal?: AbortSignal): Promise<Blob> {
  const packed = new CompressionStream("gzip");
  const blob = new Response(packed.readable).blob();
  // Else a cancelled one would be said to be lost by nobody.
  blob.catch(() => {});
  const writer = packed.writable.getWriter();
  try {
    await writer.write(niftiHeader(image));
    let done = 0;
    for (const part of chunks(image)) {
      signal?.throwIfAborted();
      await writer.write(new Uint8Array(part.buffer, part.byteOffset, part.byteLength));
      done += part.length;
      progress(done / image.voxels.length);
    }
    await writer.close();
  } catch (error) {
    await writer.abort(error).catch(() => {});
    throw error;
  }
  return new Blob([await blob], { type: "application/gzip" });
}
