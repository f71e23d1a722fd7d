// SPDX-License-Identifier: Apache-2.0
// Where segments and joints are in a pose: the twin of core/kinematics/forward.cpp, so that the gizmo sits on the joint.

import type { Rig } from "./rig.js";
import type { Pose } from "./pose.js";
import type { Quat, Vec3 } from "./rotation.js";
import { add, conjugate, inFrame, multiply, normalized, rotate, subtract, times, turnAbout, unitAxis } from "./rotation.js";
import { anglesWithin, restTurn, turn } from "./angles.js";

/** x' = q x q^-1 + t, from the scan, LPS, mm. */
export interface Motion {
  readonly q: Quat;
  readonly t: Vec3;
}

export const move = (m: Motion, point: Vec3): Vec3 => add(rotate(m.q, point), m.t);

/** The point of the scan that `m` brings to `point`. */
export const moveBack = (m: Motion, point: Vec3): Vec3 => rotate(conjugate(m.q), subtract(point, m.t));

/** One a segment. The pose is one that the body does (`constrain`). */
export function forward(rig: Rig, pose: Pose): readonly Motion[] {
  const out: Motion[] = [];
  rig.segments.forEach(({ parent, joint }, row) => {
    const q = inFrame(joint.axes, normalized(pose.rotation[row]!));
    const about = subtract(joint.center, rotate(q, joint.center));
    if (parent < 0) {
      out.push({ q, t: add(about, pose.rootTranslation) });
      return;
    }
    const t = add(about, times(joint.axes, pose.translation[row]!));
    const above = out[parent]!;
    out.push({ q: normalized(multiply(above.q, q)), t: move(above, t) });
  });
  return out;
}

/** Where a joint is now, and about which directions its angles grow, LPS. */
export interface PlacedJoint {
  readonly center: Vec3;
  /** One for each of the sequence: a small growth of the anatomical angle turns the segment about it. Unit. */
  readonly axis: readonly Vec3[];
  /** Radians, anatomical, within the limits where the rotation can be told so. */
  readonly angles: readonly number[];
}

export function placeJoint(rig: Rig, pose: Pose, motions: readonly Motion[], row: number): PlacedJoint {
  const { parent, joint } = rig.segments[row]!;
  const above = parent < 0 ? null : motions[parent]!;
  const slid = add(joint.center, parent < 0 ? pose.rootTranslation : times(joint.axes, pose.translation[row]!));
  const center = above ? move(above, slid) : slid;
  if (joint.sequence.length === 0) return { center, axis: [], angles: [] };
  const angles = anglesWithin(joint, pose.rotation[row]!);
  // The rotation is turn(rest)^-1 R(first) R(second) R(third): each axis is carried by the turns before it.
  let carried = conjugate(restTurn(joint));
  const axis = joint.sequence.map((a, i): Vec3 => {
    const inJoint = rotate(carried, unitAxis(a.axis));
    const inSpace = times(joint.axes, inJoint);
    carried = multiply(carried, turn(a, angles[i]!));
    const direction = above ? rotate(above.q, inSpace) : inSpace;
    return a.sign < 0 ? [-direction[0], -direction[1], -direction[2]] : direction;
  });
  return { center, axis, angles };
}

/** Turns `v` about a unit axis. */
export const turned = (axis: Vec3, angle: number, v: Vec3): Vec3 => rotate(turnAbout(axis, angle), v);
