// SPDX-License-Identifier: Apache-2.0
// What turns a frame's arrays into vertices for the GPU: in WebAssembly SIMD, or in plain numbers where there is none.
import type { TissueRange } from "../layout.js";
import { decodeDeltas } from "./deltas.js";
import { packNormals, packNumbers, packPositions, STRIDE, type Quantisation } from "./packed.js";

/** Of one level of detail of one stream. `slot`: which of `slots` is written; a frame writes all of its tissues there. */
export interface Kernel {
  readonly slots: Uint16Array[];
  /** `keep`: as the keyframe of deltas that follow. */
  packNumbers(slot: number, range: TissueRange, numbers: Uint16Array, normals: Int8Array | undefined, keep: boolean): void;
  /** Throws ProtocolError for what are no deltas of so many vertices. */
  decodeDeltas(slot: number, range: TissueRange, data: Uint8Array, normals: Int8Array | undefined): void;
  packPositions(slot: number, range: TissueRange, positions: Float32Array, quantisation: Quantisation, normals: Int8Array | undefined): void;
}

export interface KernelOptions {
  ranges: TissueRange[];
  vertexCount: number;
  slots: number;
  /** Deltas will come. */
  deltas: boolean;
  /** Slots in memory that threads share. */
  shared: boolean;
}

export type MakeKernel = (options: KernelOptions) => Kernel;

export const makePlainKernel: MakeKernel = (options) => new PlainKernel(options);

const part = (vertices: Uint16Array, { firstVertex, vertexCount }: TissueRange): Uint16Array =>
  vertices.subarray(firstVertex * STRIDE, (firstVertex + vertexCount) * STRIDE);

/** For `range` of `vertices`; without normals they are NO_NORMAL, which new memory is. */
export function packPositionsInto(
  vertices: Uint16Array, range: TissueRange, positions: Float32Array, quantisation: Quantisation, normals: Int8Array | undefined,
): void {
  const out = part(vertices, range);
  packPositions(positions, quantisation, out);
  if (normals) packNormals(normals, out);
}

class PlainKernel implements Kernel {
  readonly slots: Uint16Array[];
  private readonly key: Uint16Array | undefined;

  constructor({ vertexCount, slots, deltas, shared }: KernelOptions) {
    const bytes = 2 * STRIDE * vertexCount;
    this.slots = Array.from({ length: slots }, () => new Uint16Array(shared ? new SharedArrayBuffer(bytes) : new ArrayBuffer(bytes)));
    this.key = deltas ? new Uint16Array(STRIDE * vertexCount) : undefined;
  }

  packNumbers(slot: number, range: TissueRange, numbers: Uint16Array, normals: Int8Array | undefined, keep: boolean): void {
    const out = part(this.slots[slot], range);
    packNumbers(numbers, out);
    if (normals) packNormals(normals, out);
    if (keep) part(this.key!, range).set(out);
  }

  decodeDeltas(slot: number, range: TissueRange, data: Uint8Array, normals: Int8Array | undefined): void {
    const out = part(this.slots[slot], range);
    decodeDeltas(data, part(this.key!, range), out);
    if (normals) packNormals(normals, out);
  }

  packPositions(slot: number, range: TissueRange, positions: Float32Array, quantisation: Quantisation, normals: Int8Array | undefined): void {
    packPositionsInto(this.slots[slot], range, positions, quantisation, normals);
  }
}
