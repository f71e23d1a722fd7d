// SPDX-License-Identifier: Apache-2.0
// Where the camera goes: round the whole body, before one tissue, to the front, the side or the top, and back where a link says.
import * as THREE from "three";
import type { Stage } from "./stage.js";

export type Side = "front" | "back" | "left" | "right" | "top";

// From the body towards the camera, metres, y up. The patient's left is +x.
const TOWARDS: Record<Side, readonly [number, number, number]> = {
  front: [0, 0, 1], back: [0, 0, -1], left: [1, 0, 0], right: [-1, 0, 0], top: [0, 1, 0.001],
};
const SECONDS = 0.35;

export interface CameraPlace {
  readonly position: readonly [number, number, number];
  readonly target: readonly [number, number, number];
}

export class Views {
  #flight: { from: CameraPlace; to: CameraPlace; at: number } | null = null;
  #fitted: { box: THREE.Box3; side: Side | undefined } | null = null;

  constructor(private readonly stage: Stage) {
    stage.onBeforeDraw((seconds) => this.#fly(seconds));
    stage.controls.addEventListener("start", () => (this.#flight = this.#fitted = null));
    // Until somebody moves the camera, what was fitted stays fitted when the window or the panels change.
    stage.onResize(() => this.#fitted && this.fit(this.#fitted.box, this.#fitted.side, true));
  }

  get place(): CameraPlace {
    return { position: this.stage.camera.position.toArray(), target: this.stage.controls.target.toArray() };
  }

  set place(place: CameraPlace) {
    this.#flight = this.#fitted = null;
    this.stage.camera.position.fromArray(place.position);
    this.stage.controls.target.fromArray(place.target);
    this.stage.controls.update();
    this.stage.invalidate();
  }

  /** So that `box` (LPS, mm) fills the picture, from where the camera stands or from a side. */
  fit(box: THREE.Box3, side?: Side, now = false): void {
    if (box.isEmpty()) return;
    const { camera, controls, patient } = this.stage;
    const center = box.getCenter(new THREE.Vector3()).applyMatrix4(patient.matrix);
    const direction = side ? new THREE.Vector3(...TOWARDS[side]) : camera.position.clone().sub(controls.target);
    if (direction.lengthSq() < 1e-12) direction.set(0, 0, 1);
    direction.normalize();
    const away = this.#distance(box, center, direction);
    this.#go({ position: center.clone().addScaledVector(direction, away).toArray(), target: center.toArray() }, now);
    this.#fitted = { box: box.clone(), side };
  }

  /** Turns the camera about its target, degrees. */
  turn(right: number, up: number): void {
    const { camera, controls } = this.stage;
    const offset = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
    offset.theta += THREE.MathUtils.degToRad(right);
    offset.phi = THREE.MathUtils.clamp(offset.phi - THREE.MathUtils.degToRad(up), 0.01, Math.PI - 0.01);
    const position = new THREE.Vector3().setFromSpherical(offset).add(controls.target);
    this.#go({ position: position.toArray(), target: controls.target.toArray() }, true);
  }

  /** Moves camera and target in the picture's plane, in twentieths of the picture's height. */
  pan(right: number, up: number): void {
    const { camera, controls } = this.stage;
    const height = 2 * camera.position.distanceTo(controls.target) * Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
    const by = new THREE.Vector3(right, up, 0).multiplyScalar(height / 20).applyQuaternion(camera.quaternion);
    this.#go({ position: camera.position.clone().add(by).toArray(), target: controls.target.clone().add(by).toArray() }, true);
  }

  /** Nearer (below 1) or farther. */
  zoom(factor: number): void {
    const { camera, controls } = this.stage;
    const offset = camera.position.clone().sub(controls.target);
    offset.setLength(THREE.MathUtils.clamp(offset.length() * factor, controls.minDistance, controls.maxDistance));
    this.#go({ position: offset.add(controls.target).toArray(), target: controls.target.toArray() }, true);
  }

  /** The smallest distance at which every corner of the box lies within the picture, with a margin. */
  #distance(box: THREE.Box3, center: THREE.Vector3, direction: THREE.Vector3): number {
    const { camera, patient } = this.stage;
    const up = Math.abs(direction.y) > 0.99 ? new THREE.Vector3(0, 0, -1) : new THREE.Vector3(0, 1, 0);
    const right = new THREE.Vector3().crossVectors(up, direction).normalize();
    const above = new THREE.Vector3().crossVectors(direction, right);
    const { height, freeWidth, freeHeight } = this.stage.size;
    const tangent = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2)) / height;
    let most = 0.1;
    for (let corner = 0; corner < 8; corner++) {
      const at = new THREE.Vector3(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z)
        .applyMatrix4(patient.matrix).sub(center);
      const half = Math.max(Math.abs(at.dot(above)) / (tangent * freeHeight), Math.abs(at.dot(right)) / (tangent * freeWidth));
      most = Math.max(most, half * 1.06 + at.dot(direction));
    }
    return most;
  }

  #go(to: CameraPlace, now: boolean): void {
    if (now || matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this.place = to;
      return;
    }
    this.#flight = { from: this.place, to, at: 0 };
    this.stage.invalidate();
  }

  #fly(seconds: number): void {
    const flight = this.#flight;
    if (!flight) return;
    flight.at = Math.min(1, flight.at + seconds / SECONDS);
    const share = flight.at * flight.at * (3 - 2 * flight.at);
    const between = (from: readonly number[], to: readonly number[]) => new THREE.Vector3(...from).lerp(new THREE.Vector3(...to), share);
    this.stage.camera.position.copy(between(flight.from.position, flight.to.position));
    this.stage.controls.target.copy(between(flight.from.target, flight.to.target));
    if (flight.at >= 1) this.#flight = null;
    else queueMicrotask(() => this.stage.invalidate());
  }
}
