// SPDX-License-Identifier: Apache-2.0
// From the patient's millimetres to pixels of the picture, and back along a line of sight.

import * as THREE from "three";
import type { Stage } from "../scene/stage.js";
import type { Vec3 } from "./rotation.js";
import type { Sight } from "./ring.js";

export interface ScreenPoint {
  /** Pixels of CSS from the upper left. */
  readonly x: number;
  readonly y: number;
  /** -1 to 1: outside of that it is not in the picture. */
  readonly depth: number;
}

export const three = (v: Vec3): THREE.Vector3 => new THREE.Vector3(v[0], v[1], v[2]);
export const plain = (v: THREE.Vector3): Vec3 => [v.x, v.y, v.z];

export class Projector {
  constructor(private readonly stage: Stage) {}

  toScreen(point: Vec3): ScreenPoint {
    const { canvas, camera, patient } = this.stage;
    camera.updateMatrixWorld();
    const at = three(point).applyMatrix4(patient.matrix).project(camera);
    return { x: ((at.x + 1) / 2) * canvas.clientWidth, y: ((1 - at.y) / 2) * canvas.clientHeight, depth: at.z };
  }

  sight(ray: THREE.Ray): Sight {
    const back = this.stage.patient.matrix.clone().invert();
    return {
      from: plain(ray.origin.clone().applyMatrix4(back)),
      along: plain(ray.direction.clone().transformDirection(back)),
    };
  }

  /** How long one pixel is at a point. */
  mmPerPixel(point: Vec3): number {
    const { canvas, camera, patient } = this.stage;
    camera.updateMatrixWorld();
    const depth = -three(point).applyMatrix4(patient.matrix).applyMatrix4(camera.matrixWorldInverse).z;
    return (1000 * 2 * Math.max(depth, camera.near) * Math.tan(THREE.MathUtils.degToRad(camera.fov / 2))) / Math.max(1, canvas.clientHeight);
  }

  /** Towards the viewer, from the whole of the picture. */
  towardsViewer(): Vec3 {
    const { camera, patient } = this.stage;
    return plain(camera.getWorldDirection(new THREE.Vector3()).negate().transformDirection(patient.matrix.clone().invert()));
  }

  /** Where a line of sight meets the plane through `point` that faces the viewer: a pointer that drags moves things there. */
  acrossFrom(point: Vec3, sight: Sight): Vec3 | null {
    const normal = three(this.towardsViewer());
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(normal, three(point));
    const hit = new THREE.Ray(three(sight.from), three(sight.along)).intersectPlane(plane, new THREE.Vector3());
    return hit ? plain(hit) : null;
  }
}
