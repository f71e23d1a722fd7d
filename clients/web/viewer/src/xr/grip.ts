// SPDX-License-Identifier: Apache-2.0
// A hand or a controller takes hold of the body: what it took goes with it, by inverse kinematics on the server.
import * as THREE from "three";
import { nearestVertex } from "../posing/body_map.js";
import type { BodyDrag } from "../posing/body_drag.js";
import type { SegmentUnder } from "../posing/pose_tool.js";
import { plain } from "../posing/projector.js";
import type { Vec3 } from "../posing/rotation.js";
import type { PressKind } from "./sources.js";
import type { Body } from "../scene/body.js";

/** How far a hand may be from the surface, m of the room. */
export const REACH = 0.08;

/** What is within reach. */
export interface Near {
  readonly row: number;
  readonly segment: number;
  /** mm, LPS. */
  readonly place: Vec3;
}

export class Grip {
  /** By what it was taken: letting go of anything else changes nothing. */
  kind: PressKind = "squeeze";
  #holder: XRInputSource | null = null;

  constructor(private readonly body: Body, private readonly patient: THREE.Matrix4, private readonly drag: BodyDrag,
              private readonly under: SegmentUnder) {}

  /** Who holds. It holds no more where the pull ended by itself: another took control, or the line was lost. */
  get holder(): XRInputSource | null {
    return this.drag.store.state.pull ? this.#holder : null;
  }

  near(at: THREE.Vector3, rows: readonly number[]): Near | null {
    const place = this.#place(at);
    const nearest = nearestVertex(place, rows, this.body);
    const millimetres = (1 / this.patient.getMaxScaleOnAxis()) * REACH;
    if (!nearest || nearest.far > millimetres) return null;
    return { row: nearest.row, segment: this.under(nearest.row, place), place };
  }

  /** False where poses are not taken; the poser says why. */
  take(holder: XRInputSource, kind: PressKind, { segment, place }: Near): boolean {
    if (!this.drag.begin(segment, place)) return false;
    this.#holder = holder;
    this.kind = kind;
    return true;
  }

  carry(to: THREE.Vector3): void {
    this.drag.aim(this.#place(to));
  }

  letGo(): void {
    this.#holder = null;
    void this.drag.end();
  }

  #place(at: THREE.Vector3): Vec3 {
    return plain(at.clone().applyMatrix4(this.patient.clone().invert()));
  }
}
