// SPDX-License-Identifier: Apache-2.0
// A subscription to posed surfaces, as the client's side sees it.
import type { FrameNote } from "./channel.js";
import type { Quantisation } from "./decode/packed.js";
import { Emitter } from "./emitter.js";
import { Encoding } from "./gen/ecorche/v1/common_pb.js";
import type { ClampedJoint, MeshFrame, PoseQuality, ServerTimings } from "./gen/ecorche/v1/stream_pb.js";
import type { MeshLayout } from "./layout.js";
import { SharedReader } from "./publisher.js";
import { skinOnCpu } from "./skinning/cpu.js";
import { MotionTable, type Motions } from "./skinning/motions.js";
import type { Skinning } from "./skinning/skinning.js";
import { STRIDE } from "./decode/packed.js";

export interface MeshOptions {
  /** Names; none: all. */
  tissues?: string[];
  /** Of detail: 0, all, to 3. */
  level?: number;
  /** The server may send coarser levels while the pose moves and the line is slow. */
  adaptive?: boolean;
  encoding?: Encoding;
  normals?: boolean;
  /** Quality of every pose, measured before its frame leaves. */
  quality?: boolean;
  /** The segments' motions alone: the client skins, by BodyFrame.skinned. Not with encoding, normals and adaptive. */
  motions?: boolean;
  /** Frames per second, the newest of each interval; 0: every pose. */
  maxRate?: number;
}

/** One pose of all tissues of a stream. position = offset + scale * number on each axis, mm, LPS. */
export interface BodyFrame extends Quantisation {
  stream: MeshStream;
  /** Which vertices and triangles `vertices` holds: the same object for every frame of a level. */
  layout: MeshLayout;
  /** u16 x, y, z and an octahedral normal (decode/packed.ts) for each vertex; valid until the next frame of the stream. */
  readonly vertices: Uint16Array;
  /** Of a stream of motions: what a GPU skins by (skinning/gpu.ts). `vertices` are skinned when somebody asks for them. */
  skinned: { skinning: Skinning; motions: Motions } | undefined;
  frame: bigint;
  /** 0: the rest pose of a new session. */
  poseSequence: bigint;
  level: number;
  encoding: Encoding;
  /** The newest that was measured; see PoseQuality.poseSequence. */
  quality: PoseQuality | undefined;
  clamped: ClampedJoint[];
  timings: ServerTimings | undefined;
  /** What it took on the wire. */
  bytes: number;
  decodeMs: number;
}

function sameLayout(one: MeshLayout, other: MeshLayout): boolean {
  return one.level === other.level && one.vertexCount === other.vertexCount && one.indices.length === other.indices.length
    && one.ranges.length === other.ranges.length && one.ranges.every(({ tissue, firstVertex, firstIndex }, i) =>
      tissue === other.ranges[i].tissue && firstVertex === other.ranges[i].firstVertex && firstIndex === other.ranges[i].firstIndex
      && sameNumbers(one.ranges[i].rows, other.ranges[i].rows))
    && sameNumbers(one.indices, other.indices);
}

function sameNumbers(one: Uint32Array | undefined, other: Uint32Array | undefined): boolean {
  return one === other || (one?.length === other?.length && one !== undefined && one.every((value, i) => value === other![i]));
}

type Placed = Pick<BodyFrame, "vertices" | "skinned" | "scale" | "offset">;

export interface MeshEvents {
  frame: BodyFrame;
  /** The vertices and triangles became others: after another choice of tissues, or of a model that was read again. */
  layouts: MeshLayout[];
}

export class MeshStream extends Emitter<MeshEvents> {
  /** Level by level, the finest first. */
  layouts: MeshLayout[] = [];
  /** Of a stream of motions. */
  skinning: Skinning | undefined;
  /** The newest frame. */
  latest: BodyFrame | undefined;
  /** Counts the frames. */
  generation = 0;
  /** Its number on the present connection. */
  subscription = 0;
  private table: MotionTable | undefined;
  private readonly shared = new Map<number, { slots: Uint16Array[]; reader: SharedReader }>();

  constructor(readonly handle: number, public options: MeshOptions, private readonly giveBack: (level: number, buffer: ArrayBuffer) => void) {
    super();
  }

  arrange(layouts: MeshLayout[], skinning?: Skinning): void {
    // What is the same stays the same object, so that nothing is built anew for it.
    this.layouts = layouts.map((layout) => this.layouts.find((before) => sameLayout(before, layout)) ?? layout);
    this.skinning = skinning;
    this.table = undefined;
    this.latest = undefined;
    this.shared.clear();
    this.emit("layouts", layouts);
  }

  share(level: number, slots: Uint16Array[], control: Int32Array): void {
    this.shared.set(level, { slots, reader: new SharedReader(control) });
  }

  /** Undefined where a newer frame is on its way. */
  show(note: FrameNote, frame: MeshFrame): BodyFrame | undefined {
    const layout = this.layouts.find(({ level }) => level === note.level), made = note.motions ? this.skin(note.motions) : this.framed(note);
    if (!layout || !made) return undefined;
    const { latest } = this;
    this.latest = Object.assign(made, {
      stream: this, layout,
      frame: frame.frame, poseSequence: frame.poseSequence, level: frame.level, encoding: frame.encoding,
      quality: frame.quality, clamped: frame.clamped, timings: frame.timings, bytes: note.bytes, decodeMs: note.decodeMs,
    });
    ++this.generation;
    this.emit("frame", this.latest);
    if (latest && !latest.skinned && latest.vertices.buffer instanceof ArrayBuffer) this.giveBack(latest.level, latest.vertices.buffer);
    return this.latest;
  }

  private framed(note: FrameNote): Placed | undefined {
    const vertices = this.verticesOf(note);
    return vertices && { vertices, skinned: undefined, scale: note.scale, offset: note.offset };
  }

  private skin(motions: Motions): Placed | undefined {
    const { skinning } = this;
    if (!skinning) return undefined;
    const table = this.table ??= new MotionTable(skinning);
    table.set(motions);
    let vertices: Uint16Array | undefined;
    return {
      ...table.box, skinned: { skinning, motions },
      get vertices(): Uint16Array {
        if (!vertices) {
          table.set(motions);
          skinOnCpu(skinning, table, motions.method, vertices = new Uint16Array(skinning.vertexCount * STRIDE));
        }
        return vertices;
      },
    };
  }

  private verticesOf({ level, word, buffer }: FrameNote): Uint16Array | undefined {
    if (buffer) return new Uint16Array(buffer);
    const shared = this.shared.get(level), slot = word === undefined ? undefined : shared?.reader.take(word);
    return slot === undefined ? undefined : shared!.slots[slot];
  }
}
