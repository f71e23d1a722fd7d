// SPDX-License-Identifier: Apache-2.0
// A plane that cuts the body open: through a point, across one of the patient's axes, tilted and turned from there.
import { add, dot, scale, unitAxis, type Vec3 } from "../posing/rotation.js";
import { orientationOf, type PlaneId } from "./plane.js";

export interface Clip {
  readonly on: boolean;
  readonly plane: PlaneId;
  /** mm, LPS: it goes through here. */
  readonly at: Vec3;
  /** Radians: towards the lower edge of the plane's picture, and to its right. */
  readonly tilt: number;
  readonly turn: number;
  /** What is kept is the other side. */
  readonly flipped: boolean;
}

/** Opens the front of the body. */
export const firstClip = (): Clip => ({ on: false, plane: "coronal", at: [0, 0, 0], tilt: 0, turn: 0, flipped: false });

/** Unit vectors across the plane untilted, to the right of its picture and down. */
function frame(plane: PlaneId): readonly [Vec3, Vec3, Vec3] {
  const { normal, right, rightSign, down, downSign } = orientationOf(plane);
  return [unitAxis(normal), scale(unitAxis(right), rightSign), scale(unitAxis(down), downSign)];
}

/** Across the plane, towards what is kept unless it is flipped. */
export function normalOf({ plane, tilt, turn }: Clip): Vec3 {
  const [across, right, down] = frame(plane);
  return add(add(scale(across, Math.cos(tilt) * Math.cos(turn)), scale(right, Math.cos(tilt) * Math.sin(turn))), scale(down, Math.sin(tilt)));
}

export function withNormal(clip: Clip, normal: Vec3): Clip {
  const [across, right, down] = frame(clip.plane);
  return { ...clip, tilt: Math.asin(Math.min(1, Math.max(-1, dot(normal, down)))), turn: Math.atan2(dot(normal, right), dot(normal, across)) };
}

export const moved = (clip: Clip, by: number): Clip => ({ ...clip, at: add(clip.at, scale(normalOf(clip), by)) });

/** Where it crosses the axis that it lies across untilted, mm. */
export const placeOf = ({ plane, at }: Clip): number => at[orientationOf(plane).normal]!;

export function withPlace(clip: Clip, value: number): Clip {
  const { normal } = orientationOf(clip.plane);
  return { ...clip, at: clip.at.map((each, axis) => (axis === normal ? value : each)) as unknown as Vec3 };
}

/** Of the kept side. */
export const kept = (clip: Clip): Vec3 => scale(normalOf(clip), clip.flipped ? -1 : 1);
