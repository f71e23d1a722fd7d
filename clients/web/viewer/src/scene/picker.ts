// SPDX-License-Identifier: Apache-2.0
// What lies under a pixel: the body drawn once more into a target of one pixel, as numbers. No tree over triangles that move.
import * as THREE from "three";
import type { Body } from "./body.js";
import type { Stage } from "./stage.js";

export interface Picked {
  /** Row of the tissue. */
  readonly row: number;
  /** Where on its surface, mm, LPS. */
  readonly point: THREE.Vector3;
  /** What colours the surface there: mm from rest in steps of a sixteenth, or the vertices' own number, within the range that is shown.
   *  0 while there is none. */
  readonly scalar: number;
  /** The border of the scan cuts the tissue there: this is no surface of it. */
  readonly cap: boolean;
}

export class Picker {
  #target = new THREE.WebGLRenderTarget(1, 1, {
    format: THREE.RGBAIntegerFormat, type: THREE.UnsignedIntType, internalFormat: "RGBA32UI",
    minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, generateMipmaps: false,
  });
  #scene = new THREE.Scene();
  #pixel = new Uint32Array(4);
  #floats = new Float32Array(this.#pixel.buffer);
  #clear = new THREE.Color(0, 0, 0);
  #holder = new THREE.Group();
  /** Looks along a ray: its whole picture is one pixel. */
  #eye = new THREE.PerspectiveCamera(0.1, 1, 0.01, 60);

  constructor(
    private readonly stage: Stage,
    private readonly body: Body,
  ) {
    this.#holder.matrixAutoUpdate = false;
    this.#holder.add(body.pickGroup);
    this.#scene.add(this.#holder);
  }

  /** x and y in pixels of CSS from the upper left of the picture. What one looks through is missed where something solid lies behind
   *  it. */
  pick(x: number, y: number): Picked | null {
    this.stage.window({ x, y });
    const picked = this.#through(this.stage.camera);
    this.stage.window();
    return picked;
  }

  /** Along a ray in the scene: metres, y up. */
  pickAlong(ray: THREE.Ray): Picked | null {
    this.#eye.position.copy(ray.origin);
    this.#eye.up.set(0, Math.abs(ray.direction.y) > 0.99 ? 0 : 1, Math.abs(ray.direction.y) > 0.99 ? 1 : 0);
    this.#eye.lookAt(ray.origin.clone().add(ray.direction));
    return this.#through(this.#eye);
  }

  #through(camera: THREE.Camera): Picked | null {
    return this.#draw(camera, false) ?? this.#draw(camera, true);
  }

  #draw(camera: THREE.Camera, glass: boolean): Picked | null {
    const shown: THREE.Object3D[] = [];
    for (const mesh of this.body.pickGroup.children) {
      if (!mesh.visible || Boolean(mesh.userData["glass"]) === glass) continue;
      mesh.visible = false;
      shown.push(mesh);
    }
    const { renderer, patient } = this.stage;
    const target = renderer.getRenderTarget();
    const color = renderer.getClearColor(new THREE.Color());
    const alpha = renderer.getClearAlpha();
    // Else the renderer would take a headset's camera for this one.
    const { enabled } = renderer.xr;
    renderer.xr.enabled = false;
    this.#holder.matrix.copy(patient.matrix);
    this.#holder.matrixWorldNeedsUpdate = true;
    renderer.setRenderTarget(this.#target);
    renderer.setClearColor(this.#clear, 0);
    renderer.clear();
    renderer.render(this.#scene, camera);
    renderer.readRenderTargetPixels(this.#target, 0, 0, 1, 1, this.#pixel);
    renderer.setRenderTarget(target);
    renderer.setClearColor(color, alpha);
    renderer.xr.enabled = enabled;
    for (const mesh of shown) mesh.visible = true;
    const tissue = this.#pixel[0]! & 0x7fff, cap = (this.#pixel[0]! & 0x8000) !== 0;
    if (tissue === 0) return null;
    const point = new THREE.Vector3(this.#floats[1]!, this.#floats[2]!, this.#floats[3]!);
    const coded = this.#pixel[0]! >>> 16, { x: low, y: high } = this.body.shared.scalarRange.value;
    return { row: tissue - 1, point, cap, scalar: this.body.scalar === "values" ? low + (coded / 65535) * (high - low) : coded / 16 };
  }

  dispose(): void {
    this.#target.dispose();
  }
}
