// SPDX-License-Identifier: Apache-2.0
// Which vertices and triangles the frames of a subscription hold, level by level: made once, from ModelOpened and Subscribed.
import { MeshoptDecoder } from "meshoptimizer/decoder";
import { arrayOf, ProtocolError } from "./framing.js";
import { ScalarType } from "./gen/ecorche/v1/common_pb.js";
import type { ModelOpened, Tissue } from "./gen/ecorche/v1/model_pb.js";
import type { MeshLevel } from "./gen/ecorche/v1/stream_pb.js";

/** Whoever decodes packed triangles waits for this once. Rejected where a page's policy forbids WebAssembly. */
export const unpackingReady: Promise<void> = MeshoptDecoder.ready;
// Who never waits for it has nothing packed, and nothing failed.
unpackingReady?.catch(() => {});

/** One tissue's part of the vertices and indices of a layout. */
export interface TissueRange {
  /** Row of ModelOpened.tissues. */
  tissue: number;
  firstVertex: number;
  vertexCount: number;
  firstIndex: number;
  indexCount: number;
  /** Rows of the whole tissue's vertices that are here; absent where all are. */
  rows?: Uint32Array;
}

export interface MeshLayout {
  level: number;
  vertexCount: number;
  /** Three a triangle, rows of the layout's vertices; counter-clockwise seen from outside. */
  indices: Uint32Array;
  ranges: TissueRange[];
}

/** A tissue as ModelOpened has it: how many vertices, and its triangles by rows of them. */
export interface WholeTissue {
  name: string;
  vertexCount: number;
  triangles: Uint32Array;
}

/** Throws where triangles are missing: OpenModel.without_triangles is not for this client. Where some are packed, wait for unpackingReady before. */
export function wholeTissues(model: ModelOpened, payload: Uint8Array<ArrayBuffer>): WholeTissue[] {
  return model.tissues.map((tissue) => {
    const triangles = tissue.packedTriangles ? unpackTriangles(tissue, payload) : arrayOf(tissue.triangles, payload, ScalarType.U32, 3);
    return { name: tissue.name, vertexCount: countOf(tissue.vertices), triangles };
  });
}

function unpackTriangles({ name, packedTriangles, triangleCount }: Tissue, payload: Uint8Array<ArrayBuffer>): Uint32Array<ArrayBuffer> {
  const bytes = arrayOf(packedTriangles, payload, ScalarType.U8, 1);
  // A triangle takes a byte at least: so that a few bytes that tell of many make no room.
  if (triangleCount > BigInt(bytes.length)) throw new ProtocolError(`${triangleCount} triangles of ${name} in ${bytes.length} bytes`);
  const triangles = new Uint32Array(3 * Number(triangleCount));
  if (triangles.length === 0) return triangles;
  try {
    MeshoptDecoder.decodeIndexBuffer(new Uint8Array(triangles.buffer), triangles.length, triangles.BYTES_PER_ELEMENT, bytes);
  } catch (error) {
    throw new ProtocolError(`the triangles of ${name} cannot be unpacked: ${error instanceof Error ? error.message : error}`);
  }
  return triangles;
}

/** `names`: of the subscription; empty: all. */
export function wholeLayout(tissues: WholeTissue[], names: string[]): MeshLayout {
  const rows = tissues.map((_, row) => row).filter((row) => names.length === 0 || names.includes(tissues[row].name));
  return join(0, rows.map((row) => ({ tissue: row, vertexCount: tissues[row].vertexCount, triangles: tissues[row].triangles })));
}

export function levelLayout(level: MeshLevel, payload: Uint8Array<ArrayBuffer>, tissues: WholeTissue[]): MeshLayout {
  return join(level.level, level.parts.map((part) => {
    const rows = arrayOf(part.vertices, payload, ScalarType.U32, 1);
    const whole = tissues[part.tissue];
    if (!whole) throw new ProtocolError(`a level of detail has tissue ${part.tissue} of ${tissues.length}`);
    if (rows.some((row) => row >= whole.vertexCount)) throw new ProtocolError(`a level of detail goes beyond the vertices of ${whole.name}`);
    return { tissue: part.tissue, vertexCount: rows.length, triangles: arrayOf(part.triangles, payload, ScalarType.U32, 3), rows: rows.slice() };
  }));
}

interface Part {
  tissue: number;
  vertexCount: number;
  triangles: Uint32Array;
  rows?: Uint32Array;
}

function join(level: number, parts: Part[]): MeshLayout {
  const indices = new Uint32Array(parts.reduce((sum, part) => sum + part.triangles.length, 0));
  const ranges: TissueRange[] = [];
  let firstVertex = 0, firstIndex = 0;
  for (const { tissue, vertexCount, triangles, rows } of parts) {
    if (ranges.length > 0 && ranges[ranges.length - 1].tissue >= tissue) throw new ProtocolError("tissues of a level do not ascend");
    for (let i = 0; i < triangles.length; ++i) {
      if (triangles[i] >= vertexCount) throw new ProtocolError(`a triangle of tissue ${tissue} goes beyond its ${vertexCount} vertices`);
      indices[firstIndex + i] = firstVertex + triangles[i];
    }
    ranges.push({ tissue, firstVertex, vertexCount, firstIndex, indexCount: triangles.length, ...(rows && { rows }) });
    firstVertex += vertexCount;
    firstIndex += triangles.length;
  }
  if (firstVertex >= 2 ** 32) throw new ProtocolError(`${firstVertex} vertices are more than 32 bits can name`);
  return { level, vertexCount: firstVertex, indices, ranges };
}

function countOf(count: bigint): number {
  if (count >= 2n ** 32n) throw new ProtocolError(`${count} vertices are more than 32 bits can name`);
  return Number(count);
}
