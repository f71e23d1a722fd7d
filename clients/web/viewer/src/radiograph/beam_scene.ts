// SPDX-License-Identifier: Apache-2.0
// Source, field and detector in the scene: a pyramid from the focal spot to the detector's edges.
import * as THREE from "three";
import type { Stage } from "../scene/stage.js";
import { cornersOf, type Setup } from "./setup.js";

const COLOR = 0xffb52e;

export class BeamScene {
  readonly #group = new THREE.Group();
  readonly #edges = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: COLOR, toneMapped: false }));
  readonly #field = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({
    color: COLOR, transparent: true, opacity: 0.1, side: THREE.DoubleSide, depthWrite: false, toneMapped: false,
  }));
  readonly #plate = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({
    color: 0x2a3036, transparent: true, opacity: 0.55, side: THREE.DoubleSide, depthWrite: false, toneMapped: false,
  }));
  readonly #spot = new THREE.Mesh(new THREE.SphereGeometry(14, 20, 12), new THREE.MeshBasicMaterial({ color: COLOR, toneMapped: false }));

  constructor(private readonly stage: Stage) {
    for (const each of [this.#plate, this.#field, this.#edges, this.#spot]) {
      each.frustumCulled = false;
      // After what is glass.
      each.renderOrder = 20;
      this.#group.add(each);
    }
    this.#group.visible = false;
    stage.patient.add(this.#group);
  }

  show(setup: Setup | null): void {
    this.#group.visible = setup !== null;
    if (setup) {
      const source = new THREE.Vector3(...setup.source), middle = new THREE.Vector3(...setup.detector.centre);
      const corners = cornersOf(setup.detector).map((corner) => new THREE.Vector3(...corner));
      const next = (i: number) => corners[(i + 1) % 4]!;
      this.#edges.geometry.setFromPoints([...corners.flatMap((corner, i) => [source, corner, corner, next(i)]), source, middle]);
      this.#field.geometry.setFromPoints(corners.flatMap((corner, i) => [source, corner, next(i)]));
      this.#plate.geometry.setFromPoints([0, 1, 2, 0, 2, 3].map((i) => corners[i]!));
      this.#spot.position.copy(source);
    }
    this.stage.invalidate();
  }
}
