// SPDX-License-Identifier: Apache-2.0
// How far the nearest solid surface of the body is in every pixel: there rays end. What is shown as glass lets them through.
import * as THREE from "three";
import type { Body } from "../scene/body.js";
import type { Stage } from "../scene/stage.js";
import { depthMaterial } from "../scene/tissue_material.js";

const SOLID = 0.999;

export class SolidDepth {
  readonly #scene = new THREE.Scene();
  readonly #patient = new THREE.Group();
  readonly #group = new THREE.Group();
  readonly #material = depthMaterial();
  readonly #meshes = new Map<number, THREE.Mesh>();

  constructor(private readonly stage: Stage, private readonly body: Body) {
    // Both sides, as solid tissues are drawn.
    this.#material.side = THREE.DoubleSide;
    this.#material.transparent = false;
    for (const group of [this.#patient, this.#group]) group.matrixAutoUpdate = false;
    this.#patient.add(this.#group);
    this.#scene.add(this.#patient);
  }

  /** The body has other meshes. */
  follow(): void {
    this.#group.clear();
    this.#meshes.clear();
    for (const { row } of this.body.topology?.ranges ?? []) {
      const geometry = this.body.geometry(row);
      if (!geometry) continue;
      const mesh = new THREE.Mesh(geometry, this.#material);
      mesh.frustumCulled = false;
      this.#meshes.set(row, mesh);
      this.#group.add(mesh);
    }
  }

  /** Into the target that is set, which is cleared. */
  draw(camera: THREE.Camera, planes: THREE.Plane[]): void {
    this.#material.clippingPlanes = planes;
    this.#patient.matrix.copy(this.stage.patient.matrix);
    this.#group.matrix.copy(this.body.group.matrix);
    this.#patient.matrixWorldNeedsUpdate = true;
    for (const [row, mesh] of this.#meshes) mesh.visible = this.body.group.visible && this.body.shown(row) >= SOLID;
    this.stage.renderer.render(this.#scene, camera);
  }
}
