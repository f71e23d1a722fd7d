// SPDX-License-Identifier: Apache-2.0
// The poses that come with ecorche, on any rig: those of `--pose lib:NAME`, from the same file.

import type { Rig } from "./rig.js";
import { findJoint } from "./rig.js";
import type { Pose } from "./pose.js";
import { restPose } from "./pose.js";
import { restAngles, rotationFromAngles, type Angles } from "./angles.js";
import { DEGREES, transposedTimes, type Quat } from "./rotation.js";

export interface Preset {
  readonly name: string;
  readonly pose: Pose;
}

/** What io/case/data/poses.yaml holds. */
export type Library = Readonly<Record<string, {
  readonly root?: { readonly rotation: Quat };
  /** By the name of a joint without its side. */
  readonly joints: Readonly<Record<string, Readonly<Record<string, number>>>>;
  /** Of joints that have none. */
  readonly middle?: Readonly<Record<string, Readonly<Record<string, number>>>>;
}>>;

// What one rig calls the opposite of the other: core/kinematics/named_angles.cpp.
const EQUIVALENTS: readonly (readonly [string, string, number])[] = [
  ["adduction", "abduction", -1], ["eversion", "inversion", -1], ["depression", "elevation", -1],
  ["dorsiflexion", "flexion", -1], ["dorsiflexion", "plantarflexion", -1], ["lateral_bending", "bending", 1],
];

function findAngle(rig: Rig, row: number, name: string): { angle: number; sign: number } | null {
  const find = (wanted: string) => rig.segments[row]!.joint.sequence.findIndex((a) => a.name === wanted);
  const own = find(name);
  if (own >= 0) return { angle: own, sign: 1 };
  for (const [a, b, sign] of EQUIVALENTS) {
    const other = a === name ? find(b) : b === name ? find(a) : -1;
    if (other >= 0) return { angle: other, sign };
  }
  return null;
}

/** Null where the rig has none of the pose's joints. */
export function presetPose(library: Library, name: string, rig: Rig): Pose | null {
  const entry = library[name]!;
  const rest = restPose(rig);
  const rotation = [...rest.rotation];
  let found = false;
  const turn = (joint: string, angles: Readonly<Record<string, number>>) => {
    const row = findJoint(rig, joint);
    if (row < 0 || rig.segments[row]!.joint.sequence.length === 0) return;
    const values = [...restAngles(rig.segments[row]!.joint)] as [number, number, number];
    for (const [key, degrees] of Object.entries(angles)) {
      const at = findAngle(rig, row, key.replace(/_deg$/, ""));
      if (!at) continue;
      values[at.angle] = at.sign * degrees / DEGREES;
      found = true;
    }
    rotation[row] = rotationFromAngles(rig.segments[row]!.joint, values as Angles);
  };
  for (const [joint, angles] of Object.entries(entry.joints)) {
    for (const side of ["_left", "_right"]) turn(joint + side, angles);
  }
  for (const [joint, angles] of Object.entries(entry.middle ?? {})) turn(joint, angles);
  if (!found) return null;
  if (entry.root) {
    // Given in the room: into the root joint's own frame.
    const [w, x, y, z] = entry.root.rotation;
    rotation[0] = [w, ...transposedTimes(rig.segments[0]!.joint.axes, [x, y, z])];
  }
  return { ...rest, rotation };
}

export function presets(library: Library, rig: Rig): readonly Preset[] {
  return Object.keys(library).sort().flatMap((name) => {
    const pose = presetPose(library, name, rig);
    return pose ? [{ name, pose }] : [];
  });
}
