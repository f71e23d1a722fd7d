// SPDX-License-Identifier: Apache-2.0
// A pose for skinning: the segments' motions as the shaders read them, in numbers small enough for float32.
import type { Quantisation } from "../decode/packed.js";
import { Skinning as Method } from "../gen/ecorche/v1/common_pb.js";
import { POINT_NUMBERS, type Skinning } from "./skinning.js";

/** One pose of a subscription to motions. */
export interface Motions {
  /** 7 a segment: unit quaternion w, x, y, z and translation, mm, LPS: x' = q x q* + t. */
  segments: Float64Array<ArrayBuffer>;
  method: Method;
  /** Where the server would put its numbers. */
  box: Quantisation;
}

export const MOTION_FLOATS = 8;
const MIDDLE = 32768, CORNERS = 8;

export class MotionTable {
  /** Quaternion x, y, z, w, then x, y, z: where it takes the middle of the box at rest, from `box.offset`, and 0. */
  readonly rows: Float32Array<ArrayBuffer>;
  /** Where the numbers of the posed vertices stand. */
  box: Quantisation = { scale: 1, offset: [0, 0, 0] };
  private readonly middle: [number, number, number];
  /** Least and most of each segment's points at rest, mm. */
  private readonly bounds: Float64Array;

  constructor(private readonly skinning: Skinning) {
    const { box: { scale, offset }, segments } = skinning;
    this.rows = new Float32Array(MOTION_FLOATS * segments);
    this.middle = [offset[0] + MIDDLE * scale, offset[1] + MIDDLE * scale, offset[2] + MIDDLE * scale];
    this.bounds = boundsOf(skinning);
  }

  set({ segments, box }: Motions): void {
    this.box = this.boxOf(segments, box);
    const { offset } = this.box, place = [0, 0, 0];
    for (let s = 0; s < this.skinning.segments; ++s) {
      const from = 7 * s, to = MOTION_FLOATS * s;
      move(segments, from, this.middle, place);
      this.rows[to] = segments[from + 1];
      this.rows[to + 1] = segments[from + 2];
      this.rows[to + 2] = segments[from + 3];
      this.rows[to + 3] = segments[from];
      for (let axis = 0; axis < 3; ++axis) this.rows[to + 4 + axis] = place[axis] - offset[axis];
    }
  }

  /** That of the server, unless something may lie outside: then one of its own, so that nothing is clamped. */
  private boxOf(segments: Float64Array, box: Quantisation): Quantisation {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], place = [0, 0, 0];
    for (let s = 0; s < this.skinning.segments; ++s) {
      const at = 6 * s;
      if (!(this.bounds[at] <= this.bounds[at + 3])) continue;
      for (let corner = 0; corner < CORNERS; ++corner) {
        const from = [0, 1, 2].map((axis) => this.bounds[at + axis + (corner >> axis & 1) * 3]);
        move(segments, 7 * s, from, place);
        for (let axis = 0; axis < 3; ++axis) {
          low[axis] = Math.min(low[axis], place[axis]);
          high[axis] = Math.max(high[axis], place[axis]);
        }
      }
    }
    const inside = low.every((value, axis) => value > box.offset[axis] + box.scale && high[axis] < box.offset[axis] + 65534 * box.scale);
    if (inside || !(low[0] <= high[0])) return box;
    const extent = 1.2 * Math.max(1, ...high.map((value, axis) => value - low[axis]));
    return { scale: extent / 65535, offset: low.map((value, axis) => (value + high[axis] - extent) / 2) as [number, number, number] };
  }
}

/** Of the motion at `at`. */
function move(motions: Float64Array, at: number, from: ArrayLike<number>, to: number[]): void {
  const w = motions[at], x = motions[at + 1], y = motions[at + 2], z = motions[at + 3];
  const tx = 2 * (y * from[2] - z * from[1]), ty = 2 * (z * from[0] - x * from[2]), tz = 2 * (x * from[1] - y * from[0]);
  to[0] = from[0] + w * tx + y * tz - z * ty + motions[at + 4];
  to[1] = from[1] + w * ty + z * tx - x * tz + motions[at + 5];
  to[2] = from[2] + w * tz + x * ty - y * tx + motions[at + 6];
}

function boundsOf({ segments, pointCount, points, influences, weights, box }: Skinning): Float64Array {
  const bounds = new Float64Array(6 * segments);
  for (let s = 0; s < segments; ++s) bounds.fill(Infinity, 6 * s, 6 * s + 3).fill(-Infinity, 6 * s + 3, 6 * s + 6);
  for (let p = 0; p < pointCount; ++p) {
    for (let k = 0; k < influences; ++k) {
      const at = 2 * (p * influences + k);
      if (weights[at + 1] === 0) break;
      const to = 6 * weights[at];
      for (let axis = 0; axis < 3; ++axis) {
        const value = box.offset[axis] + box.scale * points[p * POINT_NUMBERS + axis];
        if (value < bounds[to + axis]) bounds[to + axis] = value;
        if (value > bounds[to + axis + 3]) bounds[to + axis + 3] = value;
      }
    }
  }
  return bounds;
}
