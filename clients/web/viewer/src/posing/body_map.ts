// SPDX-License-Identifier: Apache-2.0
// From what lies under a pointer to the segment that carries it: a bone knows its own, and all else goes by the nearest bone.

import type { Body } from "../scene/body.js";
import { STRIDE } from "../scene/body.js";
import type { Tissue } from "../state/app_state.js";
import { move, type Motion } from "./forward.js";
import type { Rig } from "./rig.js";
import { length, subtract, type Vec3 } from "./rotation.js";

/** `point`: mm, LPS, on the posed body. */
export function segmentAt(tissue: Tissue | undefined, point: Vec3, tissues: readonly Tissue[], body: Body, rig: Rig, motions: readonly Motion[]): number {
  if (tissue && tissue.segment >= 0) return tissue.segment;
  return nearestBone(point, tissues, body) ?? nearestJoint(point, rig, motions);
}

function nearestBone(point: Vec3, tissues: readonly Tissue[], body: Body): number | null {
  const nearest = nearestVertex(point, tissues.filter((tissue) => tissue.segment >= 0).map((tissue) => tissue.row), body);
  return nearest && tissues[nearest.row]!.segment;
}

/** Of some tissues, by row, the one whose surface has a vertex nearest to a point, and how far that is; mm, LPS, on the posed body. */
export function nearestVertex(point: Vec3, rows: readonly number[], body: Body): { readonly row: number; readonly far: number } | null {
  const { positions } = body;
  if (!positions) return null;
  const { numbers, low, step } = positions;
  // In the frame's own numbers: nothing is converted on the way.
  const [x, y, z] = point.map((p, axis) => (p - low[axis]!) / step) as [number, number, number];
  let least = Infinity, best: number | null = null;
  for (const row of rows) {
    const range = body.range(row);
    if (!range) continue;
    for (let at = range.firstVertex * STRIDE, end = at + range.vertexCount * STRIDE; at < end; at += STRIDE) {
      const dx = numbers[at]! - x, dy = numbers[at + 1]! - y, dz = numbers[at + 2]! - z;
      const far = dx * dx + dy * dy + dz * dz;
      if (far >= least) continue;
      least = far;
      best = row;
    }
  }
  return best === null ? null : { row: best, far: Math.sqrt(least) * step };
}

/** Where no bone is in the picture. */
function nearestJoint(point: Vec3, rig: Rig, motions: readonly Motion[]): number {
  let least = Infinity, best = 0;
  rig.segments.forEach(({ joint }, row) => {
    const far = length(subtract(move(motions[row]!, joint.center), point));
    if (far >= least) return;
    least = far;
    best = row;
  });
  return best;
}

/** The segment of a tissue that somebody chose in the tree: a bone's own, else none. */
export const segmentOf = (tissue: Tissue | undefined): number | null => (tissue && tissue.segment >= 0 ? tissue.segment : null);
