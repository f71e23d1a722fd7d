// SPDX-License-Identifier: Apache-2.0
// Poses on their way: few at a time, and of those that wait only the newest. A queue would show what the user did long ago.
import { Skinning, type JointTranslation } from "./gen/ecorche/v1/common_pb.js";
import type { PoseUpdate } from "./gen/ecorche/v1/stream_pb.js";
import { encode, type Message } from "./requests.js";

/** A whole pose; docs/reference/protocol.md, "Poses" and "Angles". */
export interface Pose {
  /** Four per joint (w, x, y, z), in the order of Skeleton.segments: turns from the scan; all identity is the scan. */
  rotation: ArrayLike<number>;
  /** Added to the root, mm, LPS. */
  rootTranslation?: [number, number, number];
  /** Of free joints. */
  translation?: { joint: number; offset: [number, number, number] }[];
  skinning?: Skinning;
}

/** Enough that a line of 100 ms carries 80 a second. */
const IN_FLIGHT = 8;

export class PoseSender {
  /** The session's last: the next pose has a larger one. */
  sequence = 0n;
  /** The last that came from here: what the session shows up to it is no news. */
  own = 0n;
  /** The newest pose that was set. */
  newest: Pose | undefined;
  private waits = false;
  private rig = 0n;         // of the newest
  private sentAs = 0n;      // the newest's sequence
  private readonly flying = new Set<bigint>();

  constructor(private readonly send: (message: Message) => boolean) {}

  set(pose: Pose, rigDigest: bigint): void {
    // What cannot be written is told to who gave it: it may wait, and would break the connection when it leaves.
    encode({ case: "poseUpdate", value: updateOf(pose, 0n, rigDigest) });
    this.newest = pose;
    this.rig = rigDigest;
    this.waits = true;
    this.flush(rigDigest);
  }

  /** After a loss and restart(): the newest pose goes again where the session never got it. */
  recover(rigDigest: bigint): void {
    if (this.newest && this.sentAs > this.sequence) this.waits = true;
    if (this.waits) this.flush(rigDigest);
  }

  /** A PoseAck: of a pose of ours, of ones that it overtook, or of a clip's. */
  acknowledged(sequence: bigint, rigDigest: bigint): void {
    for (const sent of this.flying) if (sent <= sequence) this.flying.delete(sent);
    if (sequence > this.sequence) this.sequence = sequence;
    if (this.waits) this.flush(rigDigest);
  }

  /** A new connection, or control that was granted: what flew is lost. */
  restart(sequence: bigint): void {
    this.flying.clear();
    this.sequence = sequence;
    this.own = 0n;
  }

  /** A sequence for a pose that the server finds. */
  take(): bigint {
    return (this.own = ++this.sequence);
  }

  private flush(rigDigest: bigint): void {
    if (this.rig !== rigDigest) this.waits = false;  // another body: its joints are others
    if (!this.newest || !this.waits || this.flying.size >= IN_FLIGHT) return;
    const sequence = this.sequence + 1n;
    if (!this.send({ case: "poseUpdate", value: updateOf(this.newest, sequence, rigDigest) })) return;
    this.waits = false;
    this.sequence = this.own = sequence;
    this.flying.add(sequence);
    this.sentAs = sequence;
  }
}

export const vector = ([x, y, z]: [number, number, number]) => ({ $typeName: "ecorche.v1.Vector3" as const, x, y, z });

function updateOf(pose: Pose, sequence: bigint, rigDigest: bigint): PoseUpdate {
  return {
    $typeName: "ecorche.v1.PoseUpdate", sequence, rigDigest,
    rootTranslation: pose.rootTranslation && vector(pose.rootTranslation),
    rotation: Array.from(pose.rotation),
    translation: (pose.translation ?? []).map(({ joint, offset }): JointTranslation => (
      { $typeName: "ecorche.v1.JointTranslation", joint, offset: vector(offset) })),
    skinning: pose.skinning ?? Skinning.UNSPECIFIED,
  };
}
