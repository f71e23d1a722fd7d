// SPDX-License-Identifier: Apache-2.0
// The frames of one subscription: each is checked whole against the layout of its level, then decoded into a free buffer. Where
// none is free the newest frame waits for one, and takes the place of an older one that waits.
import { arrayOf, ProtocolError } from "./framing.js";
import { Encoding, ScalarType } from "./gen/ecorche/v1/common_pb.js";
import { MeshArray_Kind, type MeshArray, type MeshFrame } from "./gen/ecorche/v1/stream_pb.js";
import { decodeDeltas } from "./decode/deltas.js";
import { packNormals, packNumbers, packPositions, quantisationOf, STRIDE, type Quantisation } from "./decode/packed.js";
import type { MeshLayout, TissueRange } from "./layout.js";

const BUFFERS = 3;

export interface Decoded extends Quantisation {
  buffer: ArrayBuffer;
}

/** What is kept for one level from frame to frame. */
class Level {
  vertices: Uint16Array<ArrayBuffer> | undefined;
  key: { number: bigint; vertices: Uint16Array } | undefined;
  free: ArrayBuffer[] = [];
  made = 0;

  constructor(readonly layout: MeshLayout) {}
}

export class MeshFeed {
  private readonly levels = new Map<number, Level>();

  constructor(layouts: MeshLayout[], readonly topology: bigint) {
    for (const layout of layouts) this.levels.set(layout.level, new Level(layout));
  }

  /** Undefined where the frame waits for a buffer. Throws ProtocolError for what is no frame of this subscription. */
  decode(frame: MeshFrame, payload: Uint8Array<ArrayBuffer>): Decoded | undefined {
    const level = this.levels.get(frame.level);
    if (!level) throw new ProtocolError(`a frame of level ${frame.level}, which was not subscribed to`);
    if (frame.topologyDigest !== this.topology) throw new ProtocolError("a frame of another topology");
    const { ranges, vertexCount } = level.layout;
    const positions = arraysOf(frame.arrays, MeshArray_Kind.POSITIONS, ranges), normals = normalsOf(frame.arrays, ranges, payload);
    const isDelta = frame.encoding === Encoding.U16_DELTA && frame.keyframe !== frame.frame;
    const quantisation = isDelta || frame.encoding !== Encoding.F32 ? boxOf(frame) : undefined;

    if (isDelta) {
      if (level.key?.number !== frame.keyframe) throw new ProtocolError(`frame ${frame.frame} is against keyframe ${frame.keyframe}, which did not come`);
      const { key } = level, deltas = positions.map((array) => bytesOf(array, payload)), vertices = level.vertices!;
      ranges.forEach((range, i) => decodeDeltas(deltas[i], part(key.vertices, range), part(vertices, range)));
    } else if (frame.encoding === Encoding.F32) {
      const rows = positions.map((array, i) => rowsOf(array, payload, ScalarType.F32, ranges[i]));
      const own = quantisationOf(rows), vertices = (level.vertices ??= new Uint16Array(vertexCount * STRIDE));
      ranges.forEach((range, i) => packPositions(rows[i], own, part(vertices, range)));
      return this.publish(level, normals, own);
    } else {
      const rows = positions.map((array, i) => rowsOf(array, payload, ScalarType.U16, ranges[i]));
      const vertices = (level.vertices ??= new Uint16Array(vertexCount * STRIDE));
      ranges.forEach((range, i) => packNumbers(rows[i], part(vertices, range)));
      if (frame.encoding === Encoding.U16_DELTA) {
        level.key ??= { number: 0n, vertices: new Uint16Array(vertexCount * STRIDE) };
        level.key.vertices.set(vertices);
        level.key.number = frame.frame;
      }
    }
    return this.publish(level, normals, quantisation!);
  }

  /** A buffer of this level that the other side needs no more. */
  giveBack(level: number, buffer: ArrayBuffer): void {
    this.levels.get(level)?.free.push(buffer);
  }

  private publish(level: Level, normals: Int8Array[] | undefined, quantisation: Quantisation): Decoded | undefined {
    const vertices = level.vertices!;
    if (normals) level.layout.ranges.forEach((range, i) => packNormals(normals[i], part(vertices, range)));
    let buffer = level.free.pop();
    if (!buffer && level.made < BUFFERS) {
      buffer = new ArrayBuffer(vertices.byteLength);
      ++level.made;
    }
    if (!buffer) return undefined;
    new Uint16Array(buffer).set(vertices);
    return { buffer, ...quantisation };
  }
}

const part = (vertices: Uint16Array, range: TissueRange): Uint16Array =>
  vertices.subarray(range.firstVertex * STRIDE, (range.firstVertex + range.vertexCount) * STRIDE);

/** The arrays of one kind, a tissue of the layout each, in its order. */
function arraysOf(arrays: MeshArray[], kind: MeshArray_Kind, ranges: TissueRange[]): MeshArray[] {
  const found = arrays.filter((array) => array.kind === kind);
  if (found.length !== ranges.length || found.some((array, i) => array.tissue !== ranges[i].tissue)) {
    throw new ProtocolError(`a frame with ${found.length} arrays of kind ${kind}, not those of its ${ranges.length} tissues`);
  }
  return found;
}

function normalsOf(arrays: MeshArray[], ranges: TissueRange[], payload: Uint8Array<ArrayBuffer>): Int8Array[] | undefined {
  if (!arrays.some((array) => array.kind === MeshArray_Kind.NORMALS)) return undefined;
  return arraysOf(arrays, MeshArray_Kind.NORMALS, ranges).map((array, i) => {
    const rows = arrayOf(array.array, payload, ScalarType.I8, 2);
    if (rows.length !== 2 * ranges[i].vertexCount) throw new ProtocolError(`${rows.length / 2} normals for ${ranges[i].vertexCount} vertices`);
    return rows;
  });
}

function rowsOf<T extends ScalarType.F32 | ScalarType.U16>(array: MeshArray, payload: Uint8Array<ArrayBuffer>, type: T, range: TissueRange) {
  const rows = arrayOf(array.array, payload, type, 3);
  if (rows.length !== 3 * range.vertexCount) throw new ProtocolError(`${rows.length / 3} positions for ${range.vertexCount} vertices`);
  return rows;
}

const bytesOf = (array: MeshArray, payload: Uint8Array<ArrayBuffer>): Uint8Array => arrayOf(array.array, payload, ScalarType.U8, 1);

function boxOf(frame: MeshFrame): Quantisation {
  const { box } = frame;
  if (!box || !(box.step > 0)) throw new ProtocolError("a frame of numbers without their box");
  return { scale: box.step, offset: [box.lowX, box.lowY, box.lowZ] };
}
