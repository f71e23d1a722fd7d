// SPDX-License-Identifier: Apache-2.0
// Closes what a clipping plane opens: each tissue that is shown gets a lid in its colour where the plane cuts it, by counting its
// surfaces in the stencil. Right for surfaces that enclose something; others have holes to look into.
import * as THREE from "three";
import type { Body } from "./body.js";
import { lookOf } from "./palette.js";
import { countMaterial } from "./tissue_material.js";
import type { Stage } from "./stage.js";

export interface CappedTissue {
  readonly row: number;
  readonly name: string;
  readonly group: string;
}

interface Cap {
  readonly row: number;
  readonly far: THREE.Mesh;
  readonly near: THREE.Mesh;
  readonly lid: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
}

// m: wider than any body.
const SIZE = 6;
// After all that is solid, before what is glass.
const ORDER = 2;

export class ClipCaps {
  readonly #lids = new THREE.Group();
  readonly #far: THREE.ShaderMaterial;
  readonly #near: THREE.ShaderMaterial;
  readonly #quad = new THREE.PlaneGeometry(SIZE, SIZE);
  #caps: Cap[] = [];
  #on = false;

  constructor(stage: Stage, private readonly body: Body, private readonly plane: THREE.Plane) {
    this.#far = countMaterial(THREE.BackSide, [plane]);
    this.#near = countMaterial(THREE.FrontSide, [plane]);
    stage.scene.add(this.#lids);
    stage.onBeforeDraw(() => this.#update());
    // What surfaces with holes left over.
    stage.onAfterDraw(() => this.#on && stage.renderer.clearStencil());
  }

  /** Of these tissues, from outside inwards: the later lid lies over the earlier one. */
  setTissues(tissues: readonly CappedTissue[]): void {
    for (const { far, near, lid } of this.#caps) {
      this.body.group.remove(far, near);
      this.#lids.remove(lid);
      lid.material.dispose();
    }
    this.#caps = tissues.flatMap(({ row, name, group }, at) => {
      const geometry = this.body.geometry(row);
      if (!geometry) return [];
      const far = new THREE.Mesh(geometry, this.#far), near = new THREE.Mesh(geometry, this.#near);
      const lid = new THREE.Mesh(this.#quad, new THREE.MeshBasicMaterial({
        color: lookOf(name, group).color, side: THREE.DoubleSide, toneMapped: false,
        stencilWrite: true, stencilRef: 0, stencilFunc: THREE.NotEqualStencilFunc,
        stencilFail: THREE.ReplaceStencilOp, stencilZFail: THREE.ReplaceStencilOp, stencilZPass: THREE.ReplaceStencilOp,
      }));
      far.renderOrder = near.renderOrder = ORDER + at / 1000;
      lid.renderOrder = ORDER + (at + 0.5) / 1000;
      for (const each of [far, near, lid]) each.frustumCulled = false;
      this.body.group.add(far, near);
      this.#lids.add(lid);
      return [{ row, far, near, lid }];
    });
    this.#update();
  }

  setOn(on: boolean): void {
    this.#on = on;
    this.#update();
  }

  #update(): void {
    this.#lids.visible = this.#on;
    this.#lids.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), this.plane.normal);
    this.plane.coplanarPoint(this.#lids.position);
    for (const { row, far, near, lid } of this.#caps) far.visible = near.visible = lid.visible = this.#on && this.body.shown(row) > 0;
  }
}
