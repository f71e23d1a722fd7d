// SPDX-License-Identifier: Apache-2.0
// The skeleton of a model as posing uses it: plain numbers out of ModelOpened.skeleton.

import type { Mat3, Vec3 } from "./rotation.js";

export type JointKind = "ball" | "hinge" | "universal" | "fixed" | "free";

/** One anatomical angle: a turn about one axis of the joint's frame. In the order of the sequence the turns are intrinsic. */
export interface AngleAxis {
  readonly name: string;
  /** 0 x, 1 y, 2 z. */
  readonly axis: number;
  /** -1 where the positive anatomical angle is the negative turn. */
  readonly sign: number;
  /** Radians, anatomical: of the scan, and the limits, infinite where there are none. */
  readonly rest: number;
  readonly min: number;
  readonly max: number;
  /** Where the body stays one, the other angles at rest: measured by `ecorche calibrate`; null where nobody did. */
  readonly safe: { readonly from: number; readonly to: number } | null;
}

/** An angle or a slide that the server sets after another joint's angle, counted from rest. */
export interface Coupling {
  readonly joint: number;
  readonly angle: number;
  /** Of the driven joint: which of its angles, or the axis along which it slides; the other is -1. */
  readonly drivenAngle: number;
  readonly slideAxis: number;
  /** Radians a radian; of a slide mm a radian. */
  readonly ratio: number;
}

export interface Joint {
  readonly name: string;
  readonly kind: JointKind;
  /** In the scan, LPS, mm. */
  readonly center: Vec3;
  /** x, y and z of the joint's frame in the scan, LPS. */
  readonly axes: Mat3;
  readonly sequence: readonly AngleAxis[];
  readonly coupled: readonly Coupling[];
}

export interface Segment {
  readonly name: string;
  /** Row of the parent, smaller than its own; -1 for the root. */
  readonly parent: number;
  readonly joint: Joint;
}

/** Parents first; segment i has joint i; row 0 is the root. */
export interface Rig {
  readonly name: string;
  readonly segments: readonly Segment[];
}

interface WireVector {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** What is read of the message `ecorche.v1.SafeRange`: turns from rest, infinite where nothing was met. */
export interface WireSafeRange {
  readonly joint: number;
  readonly angle: number;
  readonly negative: boolean;
  readonly looked: number;
  readonly correctedInverted: number;
  readonly correctedVolume: number;
  readonly bones: number;
  /** Not there of older servers and models. */
  readonly correctedContact?: number;
}

type Drives = { case: "drivenAngle" | "slideAxis"; value: number } | { case: undefined; value?: undefined };

/** What is read of the message `ecorche.v1.Skeleton`; servers older than `coupled` leave it out. */
export interface WireSkeleton {
  readonly name: string;
  readonly segments: readonly {
    readonly name: string;
    readonly parent: number;
    readonly joint?: {
      readonly name: string;
      readonly kind: number;
      readonly center?: WireVector;
      readonly axisX?: WireVector;
      readonly axisY?: WireVector;
      readonly axisZ?: WireVector;
      readonly sequence: readonly { name: string; axis: number; negative: boolean; rest: number; min: number; max: number }[];
      readonly coupled?: readonly { joint: number; angle: number; drives: Drives; ratio: number }[];
    };
  }[];
}

// By the numbers of ecorche.v1.JointKind.
const KINDS: readonly (JointKind | null)[] = [null, "ball", "hinge", "universal", "fixed", "free"];

const vector = (v?: WireVector): Vec3 => (v ? [v.x, v.y, v.z] : [0, 0, 0]);

// The nearest of what goes wrong; as far as was looked where nothing does. A way that was not looked at leaves no room.
function safeOf(ranges: readonly WireSafeRange[], joint: number, angle: number, rest: number): AngleAxis["safe"] {
  const mine = ranges.filter((r) => r.joint === joint && r.angle === angle);
  if (mine.length === 0) return null;
  const far = (negative: boolean) =>
    Math.max(0, ...mine.filter((r) => r.negative === negative)
      .map((r) => Math.min(r.looked, r.correctedInverted, r.correctedVolume, r.bones, r.correctedContact ?? Infinity)));
  return { from: rest - far(true), to: rest + far(false) };
}

/** Throws where the skeleton is none: it decides what is sent for a patient. */
export function rigOf(skeleton: WireSkeleton, safeRanges: readonly WireSafeRange[] = []): Rig {
  const segments = skeleton.segments.map((segment, row): Segment => {
    const joint = segment.joint;
    const kind = joint && KINDS[joint.kind];
    if (!joint || !kind) throw new Error(`skeleton: the joint of segment "${segment.name}" is of a kind that this viewer does not know`);
    if (row === 0 ? segment.parent !== -1 : segment.parent < 0 || segment.parent >= row) {
      throw new Error(`skeleton: segment "${segment.name}" comes before its parent`);
    }
    const axes = joint.sequence.map((a) => a.axis);
    if (kind !== "fixed" && (axes.length !== 3 || new Set(axes).size !== 3 || axes.some((a) => a > 2))) {
      throw new Error(`skeleton: the sequence of joint "${joint.name}" is not three different axes`);
    }
    return {
      name: segment.name,
      parent: segment.parent,
      joint: {
        name: joint.name,
        kind,
        center: vector(joint.center),
        axes: [vector(joint.axisX), vector(joint.axisY), vector(joint.axisZ)],
        sequence: joint.sequence.map((a, i) => ({
          name: a.name, axis: a.axis, sign: a.negative ? -1 : 1, rest: a.rest, min: a.min, max: a.max,
          safe: safeOf(safeRanges, row, i, a.rest),
        })),
        coupled: (joint.coupled ?? []).map((c) => ({
          joint: c.joint, angle: c.angle, ratio: c.ratio,
          drivenAngle: c.drives.case === "drivenAngle" ? c.drives.value : -1,
          slideAxis: c.drives.case === "slideAxis" ? c.drives.value : -1,
        })),
      },
    };
  });
  for (const { joint } of segments) {
    for (const c of joint.coupled) {
      if (c.joint >= segments.length || c.angle > 2 || c.drivenAngle > 2 || c.slideAxis > 2) {
        throw new Error(`skeleton: joint "${joint.name}" is coupled to what there is not`);
      }
    }
  }
  return { name: skeleton.name, segments };
}

/** Row of the joint, or -1. */
export const findJoint = (rig: Rig, name: string): number => rig.segments.findIndex((s) => s.joint.name === name);

/** How many angles of its sequence a joint can change. */
export const FREE_ANGLES: Readonly<Record<JointKind, number>> = { ball: 3, hinge: 1, universal: 2, fixed: 0, free: 3 };

/** Whether angle `i` follows another joint, so that nobody sets it. */
export const follows = (joint: Joint, i: number): boolean => joint.coupled.some((c) => c.drivenAngle === i);
