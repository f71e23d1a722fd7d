// SPDX-License-Identifier: Apache-2.0
// Where the body stands in the room: on the floor, before whoever looks and turned to them; larger, smaller and about on demand.
import * as THREE from "three";

/** From the eyes to the middle of the body, m: at arm's length from its surface. */
export const DISTANCE = 1.2;
const SMALLEST = 0.1;
const LARGEST = 5;

export class Stand {
  readonly position = new THREE.Vector3();
  yaw = 0;
  scale = 1;

  /** `home`: from the patient's mm to the page's metres, y up, the front along +z. `foot`: there, what is put on the floor. */
  constructor(private readonly home: THREE.Matrix4, private readonly foot: THREE.Vector3) {}

  /** Before somebody at `eyes` who looks along `gaze`, turned to them. */
  before(eyes: THREE.Vector3, gaze: THREE.Vector3): void {
    const level = new THREE.Vector3(gaze.x, 0, gaze.z);
    // Who looks straight down or up has no direction.
    if (level.length() < 1e-3) level.set(0, 0, -1);
    level.normalize();
    this.position.set(eyes.x, 0, eyes.z).addScaledVector(level, DISTANCE);
    this.yaw = Math.atan2(-level.x, -level.z);
  }

  turn(radians: number): void {
    this.yaw += radians;
  }

  /** From the floor: the feet stay where they are. */
  resize(factor: number): void {
    this.scale = THREE.MathUtils.clamp(this.scale * factor, SMALLEST, LARGEST);
  }

  /** From the patient's LPS mm to the room's metres. */
  matrix(into: THREE.Matrix4): THREE.Matrix4 {
    return into.makeTranslation(this.position.x, this.position.y, this.position.z)
      .multiply(new THREE.Matrix4().makeRotationY(this.yaw))
      .multiply(new THREE.Matrix4().makeScale(this.scale, this.scale, this.scale))
      .multiply(new THREE.Matrix4().makeTranslation(-this.foot.x, -this.foot.y, -this.foot.z))
      .multiply(this.home);
  }
}
