// SPDX-License-Identifier: Apache-2.0
// A pose: the turn of every joint from the scan, in the joint's frame. All identity and zero is the scan.

import type { Pose as ClientPose } from "../../../protocol/src/index.js";
import type { Quat, Vec3 } from "./rotation.js";
import { angularDistance, IDENTITY, length, ORIGIN, subtract } from "./rotation.js";
import type { Rig } from "./rig.js";

export interface Pose {
  /** Added to the root, LPS, mm. */
  readonly rootTranslation: Vec3;
  readonly rotation: readonly Quat[];
  /** mm in the joint's frame: of `free` joints besides the root, and what couplings slide. */
  readonly translation: readonly Vec3[];
}

export const restPose = (rig: Rig): Pose => ({
  rootTranslation: ORIGIN,
  rotation: rig.segments.map(() => IDENTITY),
  translation: rig.segments.map(() => ORIGIN),
});

export const withRotation = (pose: Pose, row: number, rotation: Quat): Pose =>
  ({ ...pose, rotation: pose.rotation.map((q, i) => (i === row ? rotation : q)) });

export const withTranslation = (pose: Pose, row: number, translation: Vec3): Pose =>
  row === 0 ? { ...pose, rootTranslation: translation }
            : { ...pose, translation: pose.translation.map((t, i) => (i === row ? translation : t)) };

/** The same to a person's eye: within a millionth of a degree and of a millimetre. */
export function samePose(a: Pose, b: Pose): boolean {
  return length(subtract(a.rootTranslation, b.rootTranslation)) < 1e-6 &&
    a.rotation.every((q, i) => angularDistance(q, b.rotation[i]!) < 1.7e-8) &&
    a.translation.every((t, i) => length(subtract(t, b.translation[i]!)) < 1e-6);
}

/** As messages carry it: PoseUpdate, PoseState, IkSolved. */
export interface WirePose {
  readonly rootTranslation?: { readonly x: number; readonly y: number; readonly z: number };
  readonly rotation: readonly number[];
  readonly translation?: readonly {
    readonly joint: number;
    readonly offset?: { readonly x: number; readonly y: number; readonly z: number };
  }[];
}

/** Throws for a pose of another number of joints. A message without rotations is the scan: what a new session shows. */
export function poseOf(rig: Rig, wire: WirePose): Pose {
  const rest = restPose(rig);
  const { rotation, rootTranslation: root } = wire;
  if (rotation.length !== 0 && rotation.length !== 4 * rig.segments.length) {
    throw new Error(`a pose of ${rotation.length / 4} joints for a skeleton of ${rig.segments.length}`);
  }
  const translation = [...rest.translation];
  for (const { joint, offset } of wire.translation ?? []) {
    if (offset && joint < translation.length) translation[joint] = [offset.x, offset.y, offset.z];
  }
  return {
    rootTranslation: root ? [root.x, root.y, root.z] : ORIGIN,
    rotation: rotation.length === 0 ? rest.rotation : rest.rotation.map((_, i): Quat =>
      [rotation[4 * i]!, rotation[4 * i + 1]!, rotation[4 * i + 2]!, rotation[4 * i + 3]!]),
    translation,
  };
}

/** As the client sends it. */
export function wireOf(pose: Pose): ClientPose {
  const copy = (v: Vec3): [number, number, number] => [v[0], v[1], v[2]];
  return {
    rootTranslation: copy(pose.rootTranslation),
    rotation: pose.rotation.flat(),
    translation: pose.translation.flatMap((t, joint) => (joint > 0 && t.some((x) => x !== 0) ? [{ joint, offset: copy(t) }] : [])),
  };
}
