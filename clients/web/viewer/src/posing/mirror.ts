// SPDX-License-Identifier: Apache-2.0
// Left and right: a pose, or one limb of it, as in a mirror that stands between the sides of the body.

import type { Rig } from "./rig.js";
import { findJoint } from "./rig.js";
import type { Pose } from "./pose.js";
import type { Quat, Vec3 } from "./rotation.js";
import { anglesFromRotation, restAngles, rotationFromAngles, type Angles } from "./angles.js";
import { dot, scale, times, transposedTimes } from "./rotation.js";

const SIDES: readonly (readonly [string, string])[] = [["_left", "_right"], ["_right", "_left"]];

/** Row of the joint on the other side; its own where the name has no side; -1 where the other side is missing. */
export function counterpart(rig: Rig, row: number): number {
  const name = rig.segments[row]!.joint.name;
  for (const [from, to] of SIDES) if (name.endsWith(from)) return findJoint(rig, name.slice(0, -from.length) + to);
  return row;
}

// In the mirror turns about the axis across the body stay, those about the others change sign. Sequences of the two sides have
// the same names; an angle that means the same on both sides (flexion, abduction) has, in the rig, the sign that makes it so. So
// between sides angles are copied by name where the axes mirror each other, and else changed in sign.
function angleSign(rig: Rig, from: number, to: number, angle: number): number {
  const a = axisAtRest(rig, from, angle), b = axisAtRest(rig, to, angle);
  // A turn about v is in the mirror (x -> -x) one about (v.x, -v.y, -v.z).
  return dot([a[0], -a[1], -a[2]], b) >= 0 ? 1 : -1;
}

// The direction about which the angle grows, in the scan.
function axisAtRest(rig: Rig, row: number, angle: number): Vec3 {
  const { joint } = rig.segments[row]!;
  const { axis, sign } = joint.sequence[angle]!;
  return scale(joint.axes[axis]!, sign);
}

/** The rotation of joint `to` that mirrors that of joint `from`. Angles count from zero, not from rest: a scan is not symmetric. */
function mirrored(rig: Rig, from: number, to: number, rotation: Quat): Quat {
  const a = rig.segments[from]!.joint, b = rig.segments[to]!.joint;
  if (a.sequence.length === 0 || b.sequence.length === 0) return rotation;
  const angles = anglesFromRotation(a, rotation);
  const byName = b.sequence.map((angle, i) => {
    const at = a.sequence.findIndex((other) => other.name === angle.name);
    return at < 0 ? restAngles(b)[i]! : angleSign(rig, from, to, i) * angles[at]!;
  });
  return rotationFromAngles(b, byName as unknown as Angles);
}

/** Of the root the turn about LPS: mirrored across the plane between left and right. */
function mirroredRoot(rig: Rig, rotation: Quat): Quat {
  const { axes } = rig.segments[0]!.joint;
  const [x, y, z] = times(axes, [rotation[1], rotation[2], rotation[3]]);
  return [rotation[0], ...transposedTimes(axes, [x, -y, -z])];
}

/** The whole pose, sides exchanged. */
export function mirrorPose(rig: Rig, pose: Pose): Pose {
  const rotation = pose.rotation.map((own, row) => {
    if (row === 0) return mirroredRoot(rig, own);
    const from = counterpart(rig, row);
    return from < 0 ? own : mirrored(rig, from, row, pose.rotation[from]!);
  });
  const [x, y, z] = pose.rootTranslation;
  return { ...pose, rootTranslation: [-x, y, z], rotation };
}

/** One joint's turn given to the joint on the other side; null where there is none. */
export function mirrorJoint(rig: Rig, pose: Pose, row: number): { row: number; rotation: Quat } | null {
  const to = counterpart(rig, row);
  if (to < 0 || to === row) return null;
  return { row: to, rotation: mirrored(rig, row, to, pose.rotation[row]!) };
}
