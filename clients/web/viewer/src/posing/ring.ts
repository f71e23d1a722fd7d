// SPDX-License-Identifier: Apache-2.0
// Where the rings of a joint's gizmo lie, what their arcs show, and how a pointer turns them: no drawing.

import type { PlacedJoint } from "./forward.js";
import { turned } from "./forward.js";
import type { Rig } from "./rig.js";
import { restTurn, settable, turn } from "./angles.js";
import type { Quat, Vec3 } from "./rotation.js";
import { across, add, cross, dot, length, multiply, rotate, scale, subtract, times, transposedTimes, unit, wrapped } from "./rotation.js";

/** A ring about one angle of a joint. Directions in LPS; `from` and `to` in radians, anatomical. */
export interface Ring {
  /** Which of the joint's sequence. */
  readonly angle: number;
  readonly name: string;
  readonly value: number;
  readonly rest: number;
  /** The limits, or half a turn either way of the value where there are none. */
  readonly from: number;
  readonly to: number;
  readonly limited: boolean;
  /** The part of it in which the body stays one; null where nobody measured. */
  readonly safe: { readonly from: number; readonly to: number } | null;
  readonly center: Vec3;
  /** The angle grows as the segment turns about this, by the right hand. */
  readonly axis: Vec3;
  /** From the centre to the handle, square to the axis, unit: where the limb points, where it points anywhere across the ring. */
  readonly handle: Vec3;
}

/** From the centre of the ring to the place of an angle on it. */
export const directionAt = (ring: Ring, angle: number): Vec3 => turned(ring.axis, angle - ring.value, ring.handle);

/** From each joint to what it carries, in the scan: to the mean of its children's joints, or along its own z down the limb. */
export function limbDirections(rig: Rig): readonly Vec3[] {
  return rig.segments.map((segment, row) => {
    const children = rig.segments.filter((s) => s.parent === row).map((s) => s.joint.center);
    const mean = children.reduce((sum, c) => add(sum, scale(c, 1 / children.length)), [0, 0, 0] as Vec3);
    const way = children.length > 0 ? unit(subtract(mean, segment.joint.center)) : null;
    if (way) return way;
    // The end of a limb goes on as the limb came.
    const above = segment.parent < 0 ? null : unit(subtract(segment.joint.center, rig.segments[segment.parent]!.joint.center));
    return above ?? scale(segment.joint.axes[2], -1);
  });
}

/** The rings of a joint: one for each angle that a person may set. */
export function ringsOf(rig: Rig, row: number, placed: PlacedJoint, limb: Vec3, parent: Quat): readonly Ring[] {
  const { joint } = rig.segments[row]!;
  return settable(joint).map((angle): Ring => {
    const range = joint.sequence[angle]!;
    const axis = placed.axis[angle]!;
    const value = placed.angles[angle]!;
    const low = Math.min(range.min, range.rest), high = Math.max(range.max, range.rest);
    return {
      angle, name: range.name, value, rest: range.rest, axis, center: placed.center,
      from: Number.isFinite(low) ? low : value - Math.PI,
      to: Number.isFinite(high) ? high : value + Math.PI,
      limited: Number.isFinite(low) && Number.isFinite(high),
      safe: range.safe,
      handle: handleOf(rig, row, placed, limb, parent, angle),
    };
  });
}

// The limb as the turns up to this one carry it, with those after it at rest: so that a ring's arc stands still while the others turn.
function handleOf(rig: Rig, row: number, placed: PlacedJoint, limb: Vec3, parent: Quat, angle: number): Vec3 {
  const { joint } = rig.segments[row]!;
  const undo = restTurn(joint);
  let carried: Quat = [undo[0], -undo[1], -undo[2], -undo[3]];
  joint.sequence.forEach((a, i) => {
    carried = multiply(carried, turn(a, i <= angle ? placed.angles[i]! : a.rest));
  });
  const inSpace = (v: Vec3): Vec3 => rotate(parent, times(joint.axes, rotate(carried, transposedTimes(joint.axes, v))));
  const axis = placed.axis[angle]!;
  for (const candidate of [limb, [0, -1, 0], [1, 0, 0], [0, 0, 1]] as readonly Vec3[]) {
    const flat = across(inSpace(candidate), axis);
    if (length(flat) > 0.5) return unit(flat)!;
  }
  return unit(cross(axis, [0.3, 0.5, 0.8]))!;
}

/** A line of sight; the direction is unit. */
export interface Sight {
  readonly from: Vec3;
  readonly along: Vec3;
}

/** Where a sight meets the ring's plane, as an angle round it from the handle; null where the plane is seen from its edge. */
export function angleOnRing(ring: Ring, sight: Sight): number | null {
  const slope = dot(sight.along, ring.axis);
  if (Math.abs(slope) < 0.2) return null;
  const way = dot(subtract(ring.center, sight.from), ring.axis) / slope;
  if (way <= 0) return null;
  const place = subtract(add(sight.from, scale(sight.along, way)), ring.center);
  if (length(place) < 1e-9) return null;
  return Math.atan2(dot(place, cross(ring.axis, ring.handle)), dot(place, ring.handle));
}

/** Follows a pointer round a ring, over full turns, from where it took hold. */
export class RingDrag {
  #turned = 0;
  #last: number | null;

  /** `grip`: where on the ring it was taken; for rings seen from the edge `tangent` says which way on the screen, px, is one radian. */
  constructor(private readonly ring: Ring, sight: Sight, private readonly at: readonly [number, number],
              private readonly tangent: readonly [number, number]) {
    this.#last = angleOnRing(ring, sight);
  }

  /** The anatomical angle that the pointer asks for now. */
  moved(sight: Sight, at: readonly [number, number]): number {
    if (this.#last !== null) {
      const now = angleOnRing(this.ring, sight);
      if (now !== null) {
        this.#turned += wrapped(now - this.#last);
        this.#last = now;
      }
      return this.ring.value + this.#turned;
    }
    const size = this.tangent[0] ** 2 + this.tangent[1] ** 2;
    const along = (at[0] - this.at[0]) * this.tangent[0] + (at[1] - this.at[1]) * this.tangent[1];
    return this.ring.value + (size > 1e-9 ? along / size : 0);
  }
}
