// SPDX-License-Identifier: Apache-2.0
// The frames of one subscription: each is checked whole against the layout of its level, then decoded and published.
import { create, toBinary } from "@bufbuild/protobuf";
import type { FrameNote, Post, ToClient } from "./channel.js";
import type { Kernel, MakeKernel } from "./decode/kernel.js";
import { quantisationOf, type Quantisation } from "./decode/packed.js";
import { arrayOf, ProtocolError } from "./framing.js";
import { Encoding, ScalarType } from "./gen/ecorche/v1/common_pb.js";
import { EnvelopeSchema } from "./gen/ecorche/v1/envelope_pb.js";
import { MeshArray_Kind, type MeshArray, type MeshFrame } from "./gen/ecorche/v1/stream_pb.js";
import type { MeshLayout, TissueRange } from "./layout.js";
import type { Skinning } from "./skinning/skinning.js";
import { makeControl, Pool, SharedWriter, SLOTS } from "./publisher.js";

export interface FeedOptions {
  stream: number;
  layouts: MeshLayout[];
  topology: bigint;
  encoding: Encoding;
  makeKernel: MakeKernel;
  /** Frames go through memory that threads share. */
  shared: boolean;
  /** Frames bring motions alone. */
  skinning?: Skinning | undefined;
}

const MOTION_NUMBERS = 7, UNIT = 1e-6;

type Waiting = Omit<FrameNote, "buffer" | "word" | "motions">;

/** What is kept for one level from frame to frame. */
interface Level {
  kernel: Kernel;
  keyframe: bigint | undefined;
  publisher: SharedWriter | Pool;
  /** Until a buffer comes back. */
  waiting: Waiting | undefined;
}

export class MeshFeed {
  private readonly levels = new Map<number, Level>();

  constructor(private readonly options: FeedOptions, private readonly post: Post<ToClient>) {}

  /** Throws ProtocolError for what is no frame of this subscription. */
  show(frame: MeshFrame, payload: Uint8Array<ArrayBuffer>): number {
    const start = performance.now();
    const layout = this.options.layouts.find(({ level }) => level === frame.level);
    if (!layout) throw new ProtocolError(`a frame of level ${frame.level}, which was not subscribed to`);
    if (frame.topologyDigest !== this.options.topology) throw new ProtocolError("a frame of another topology");
    const note = (quantisation: Quantisation, decodeMs: number): Waiting => ({
      kind: "frame", stream: this.options.stream, level: frame.level, bytes: payload.buffer.byteLength, decodeMs, ...quantisation,
      envelope: toBinary(EnvelopeSchema, create(EnvelopeSchema, { message: { case: "meshFrame", value: { ...frame, arrays: [] } } })),
    });
    const { skinning } = this.options;
    if (skinning) {
      const segments = motionsOf(frame, payload, skinning.segments), box = boxOf(frame), decodeMs = performance.now() - start;
      this.post({ ...note(box, decodeMs), motions: { segments, method: frame.skinning, box } }, [segments.buffer]);
      return decodeMs;
    }
    const [level, quantisation] = this.decode(frame, payload, layout), decodeMs = performance.now() - start;
    this.publish(level, note(quantisation, decodeMs));
    return decodeMs;
  }

  /** A buffer of this level that the other side needs no more. */
  giveBack(number: number, buffer: ArrayBuffer): void {
    const level = this.levels.get(number);
    if (!level || level.publisher instanceof SharedWriter) return;
    level.publisher.giveBack(buffer);
    if (level.waiting) this.publish(level, level.waiting);
  }

  private decode(frame: MeshFrame, payload: Uint8Array<ArrayBuffer>, layout: MeshLayout): [Level, Quantisation] {
    const { ranges } = layout, { encoding } = frame;
    const positions = arraysOf(frame.arrays, MeshArray_Kind.POSITIONS, ranges), normals = normalsOf(frame.arrays, ranges, payload);
    if (encoding === Encoding.U16_DELTA && frame.keyframe !== frame.frame) {
      const level = this.levels.get(layout.level), quantisation = boxOf(frame);
      if (level === undefined || level.keyframe !== frame.keyframe) {
        throw new ProtocolError(`frame ${frame.frame} is against keyframe ${frame.keyframe}, which did not come`);
      }
      const slot = slotOf(level), deltas = positions.map((array) => arrayOf(array.array, payload, ScalarType.U8, 1));
      ranges.forEach((range, i) => level.kernel.decodeDeltas(slot, range, deltas[i], normals?.[i]));
      return [level, quantisation];
    }
    if (encoding === Encoding.F32) {
      const rows = positions.map((array, i) => rowsOf(array, payload, ScalarType.F32, ranges[i])), quantisation = quantisationOf(rows);
      const level = this.levelOf(layout), slot = slotOf(level);
      ranges.forEach((range, i) => level.kernel.packPositions(slot, range, rows[i], quantisation, normals?.[i]));
      return [level, quantisation];
    }
    if (encoding !== Encoding.U16 && encoding !== Encoding.U16_DELTA) throw new ProtocolError(`a frame of encoding ${encoding}, which was not asked for`);
    const rows = positions.map((array, i) => rowsOf(array, payload, ScalarType.U16, ranges[i])), quantisation = boxOf(frame);
    const level = this.levelOf(layout), slot = slotOf(level), keep = encoding === Encoding.U16_DELTA;
    if (keep && this.options.encoding !== Encoding.U16_DELTA) throw new ProtocolError("a keyframe, which was not asked for");
    ranges.forEach((range, i) => level.kernel.packNumbers(slot, range, rows[i], normals?.[i], keep));
    if (keep) level.keyframe = frame.frame;
    return [level, quantisation];
  }

  /** Made with the first frame that has bytes for all of its vertices: a few bytes that tell of many make no room. */
  private levelOf(layout: MeshLayout): Level {
    const found = this.levels.get(layout.level);
    if (found) return found;
    const { shared, makeKernel, encoding, stream } = this.options, { ranges, vertexCount } = layout;
    const kernel = makeKernel({ ranges, vertexCount, shared, slots: shared ? SLOTS : 1, deltas: encoding === Encoding.U16_DELTA });
    const control = shared ? makeControl() : undefined;
    const level: Level = {
      kernel, keyframe: undefined, waiting: undefined,
      publisher: control ? new SharedWriter(control) : new Pool(kernel.slots[0].byteLength),
    };
    if (control) this.post({ kind: "slots", stream, level: layout.level, slots: kernel.slots, control });
    this.levels.set(layout.level, level);
    return level;
  }

  private publish(level: Level, note: Waiting): void {
    if (level.publisher instanceof SharedWriter) return this.post({ ...note, word: level.publisher.publish() });
    const buffer = level.publisher.take();
    level.waiting = buffer ? undefined : note;
    if (!buffer) return;
    new Uint16Array(buffer).set(level.kernel.slots[0]);
    this.post({ ...note, buffer }, [buffer]);
  }
}

const slotOf = (level: Level): number => (level.publisher instanceof SharedWriter ? level.publisher.slot : 0);

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

function motionsOf(frame: MeshFrame, payload: Uint8Array<ArrayBuffer>, segments: number): Float64Array<ArrayBuffer> {
  const found = frame.arrays.filter(({ kind }) => kind === MeshArray_Kind.MOTIONS);
  if (found.length !== 1 || frame.arrays.length !== 1) throw new ProtocolError("a frame without the motions that were asked for");
  const rows = arrayOf(found[0].array, payload, ScalarType.F64, MOTION_NUMBERS);
  if (rows.length !== MOTION_NUMBERS * segments) throw new ProtocolError(`motions of ${rows.length / MOTION_NUMBERS} segments, not of ${segments}`);
  for (let at = 0; at < rows.length; at += MOTION_NUMBERS) {
    const length = Math.hypot(rows[at], rows[at + 1], rows[at + 2], rows[at + 3]);
    if (!(Math.abs(length - 1) < UNIT) || ![4, 5, 6].every((i) => Number.isFinite(rows[at + i]))) throw new ProtocolError("a motion that is none");
  }
  return rows.slice();
}

function boxOf(frame: MeshFrame): Quantisation {
  const { box } = frame;
  if (!box || !(box.step > 0) || ![box.step, box.lowX, box.lowY, box.lowZ].every(Number.isFinite)) throw new ProtocolError("a frame of numbers without their box");
  return { scale: box.step, offset: [box.lowX, box.lowY, box.lowZ] };
}
