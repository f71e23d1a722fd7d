// SPDX-License-Identifier: Apache-2.0
// deltas.c on memory of its own: the vertices, the keyframe by axis, and a place for one tissue's arrays.
import { ProtocolError } from "../framing.js";
import { DELTAS_WASM, DELTAS_WASM_SHARED } from "../gen/deltas_wasm.js";
import type { TissueRange } from "../layout.js";
import { packPositionsInto, type Kernel, type KernelOptions, type MakeKernel } from "./kernel.js";
import { STRIDE, type Quantisation } from "./packed.js";

const PAGE_BYTES = 65536, VERTEX_BYTES = 2 * STRIDE, AXES = 3, BLOCK = 512;
/** Most that 512 vertices take: a header, and 16 bits for each axis. */
const BLOCK_BYTES = 34 + AXES * 2 * BLOCK;
/** deltas.c reads, and of keyframes writes, so far beyond an end. */
const ROOM_BYTES = 16;
const FAULTS = ["", "the deltas end too early", "a block of deltas has no header", "the deltas go on behind their last block"];

interface Exports {
  __heap_base: WebAssembly.Global;
  decode_deltas(data: number, bytes: number, x: number, y: number, z: number, normals: number, out: number, vertices: number): number;
  pack_numbers(numbers: number, x: number, y: number, z: number, normals: number, out: number, vertices: number): void;
}

/** Undefined where the engine has no WebAssembly SIMD, or a page's policy forbids it. */
export async function loadWasmKernel(): Promise<MakeKernel | undefined> {
  const compile = async (text: string) => WebAssembly.compile(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
  try {
    const plain = await compile(DELTAS_WASM), shared = await compile(DELTAS_WASM_SHARED);
    return (options) => new WasmKernel(options.shared ? shared : plain, options);
  } catch (error) {
    if (error instanceof WebAssembly.CompileError) return undefined;
    throw error;
  }
}

class WasmKernel implements Kernel {
  readonly slots: Uint16Array[];
  private readonly bytes: Uint8Array;
  private readonly exports: Exports;
  private readonly slotAt: number[];
  private readonly keyAt: number[];
  private readonly dataAt: number;
  private readonly dataBytes: number;
  private readonly normalsAt: number;

  constructor(module: WebAssembly.Module, { ranges, vertexCount, slots, deltas, shared }: KernelOptions) {
    const most = Math.max(0, ...ranges.map((range) => range.vertexCount));
    this.dataBytes = Math.ceil(most / BLOCK) * BLOCK_BYTES;
    let end = 16384;  // deltas.c has 8 kB of stack and no more than a few constants
    const take = (bytes: number): number => {
      const at = end;
      end += Math.ceil((bytes + ROOM_BYTES) / 16) * 16;
      return at;
    };
    this.slotAt = Array.from({ length: slots }, () => take(VERTEX_BYTES * vertexCount));
    this.keyAt = deltas ? Array.from({ length: AXES }, () => take(2 * vertexCount)) : [0, 0, 0];
    this.dataAt = take(this.dataBytes);
    this.normalsAt = take(2 * most);
    const pages = Math.ceil(end / PAGE_BYTES), memory = new WebAssembly.Memory({ initial: pages, maximum: pages, shared });
    this.exports = new WebAssembly.Instance(module, { env: { memory } }).exports as unknown as Exports;
    if (this.exports.__heap_base.value > this.slotAt[0]) throw new Error("deltas.c has more constants than wasm_kernel.ts leaves room for");
    this.bytes = new Uint8Array(memory.buffer);
    this.slots = this.slotAt.map((at) => new Uint16Array(memory.buffer, at, STRIDE * vertexCount));
  }

  packNumbers(slot: number, range: TissueRange, numbers: Uint16Array, normals: Int8Array | undefined, keep: boolean): void {
    this.stage(numbers);
    const [x, y, z] = keep ? this.keyOf(range) : [0, 0, 0];
    this.exports.pack_numbers(this.dataAt, x, y, z, this.stageNormals(normals), this.outOf(slot, range), range.vertexCount);
  }

  decodeDeltas(slot: number, range: TissueRange, data: Uint8Array, normals: Int8Array | undefined): void {
    if (data.length > this.dataBytes) throw new ProtocolError(FAULTS[3]);
    this.stage(data);
    const [x, y, z] = this.keyOf(range), out = this.outOf(slot, range);
    const fault = this.exports.decode_deltas(this.dataAt, data.length, x, y, z, this.stageNormals(normals), out, range.vertexCount);
    if (fault !== 0) throw new ProtocolError(FAULTS[fault]);
  }

  packPositions(slot: number, range: TissueRange, positions: Float32Array, quantisation: Quantisation, normals: Int8Array | undefined): void {
    packPositionsInto(this.slots[slot], range, positions, quantisation, normals);
  }

  private stage(array: Uint8Array | Uint16Array): void {
    this.bytes.set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength), this.dataAt);
  }

  private stageNormals(normals: Int8Array | undefined): number {
    if (!normals) return 0;
    this.bytes.set(new Uint8Array(normals.buffer, normals.byteOffset, normals.length), this.normalsAt);
    return this.normalsAt;
  }

  private keyOf(range: TissueRange): number[] {
    return this.keyAt.map((at) => at + 2 * range.firstVertex);
  }

  private outOf(slot: number, range: TissueRange): number {
    return this.slotAt[slot] + VERTEX_BYTES * range.firstVertex;
  }
}
