// SPDX-License-Identifier: Apache-2.0
// The same planes within the body, with what one sees of them on the board.
import * as THREE from "three";
import type { Stage } from "../scene/stage.js";
import { orientationOf, pointAt, type PlaneId } from "./plane.js";
import type { Painted, Slices } from "./slices.js";

interface Sheet {
  readonly mesh: THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial>;
  readonly frame: THREE.LineLoop<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  size: string;
}

export class ScenePlanes {
  #sheets = new Map<PlaneId, Sheet>();
  #group = new THREE.Group();

  constructor(private readonly stage: Stage, private readonly slices: Slices) {
    stage.patient.add(this.#group);
    slices.onPainted((id, painted) => this.#show(id, painted));
    const visible = () => {
      const { open, inBody } = slices.store.state;
      this.#group.visible = open && inBody;
      stage.invalidate();
    };
    slices.store.watch((state) => state.open, visible, true);
    slices.store.watch((state) => state.inBody, visible);
    slices.store.watch((state) => state.smooth, (smooth) => {
      for (const { mesh } of this.#sheets.values()) filter(mesh.material.map!, smooth);
      stage.invalidate();
    });
  }

  #show(id: PlaneId, { plane, canvas }: Painted): void {
    let sheet = this.#sheets.get(id);
    if (!sheet) this.#sheets.set(id, sheet = this.#make(id));
    const { mesh, frame } = sheet, size = `${plane.width} ${plane.height}`;
    if (sheet.size !== size) {
      // A texture keeps the size that it was made with.
      sheet.size = size;
      mesh.material.map?.dispose();
      mesh.material.map = new THREE.CanvasTexture(canvas);
      mesh.material.map.colorSpace = THREE.SRGBColorSpace;
      mesh.material.map.generateMipmaps = false;
      filter(mesh.material.map, this.slices.store.state.smooth);
      mesh.material.needsUpdate = true;
    }
    mesh.material.map!.needsUpdate = true;
    const { width, height } = plane;
    const corners = [[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]]
      .map(([column, row]) => new THREE.Vector3(...pointAt(plane, column!, row!)));
    mesh.geometry.setFromPoints(corners);
    frame.geometry.setFromPoints(corners);
    this.stage.invalidate();
  }

  #make(id: PlaneId): Sheet {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("uv", new THREE.Float32BufferAttribute([0, 1, 1, 1, 1, 0, 0, 0], 2)).setIndex([0, 1, 2, 0, 2, 3]);
    // Clear where the plane leaves the body: not drawn at all there, so that order does not matter.
    const material = new THREE.MeshBasicMaterial({ side: THREE.DoubleSide, alphaTest: 0.5, toneMapped: false });
    const mesh = new THREE.Mesh(geometry, material);
    const frame = new THREE.LineLoop(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: orientationOf(id).color, toneMapped: false }));
    for (const each of [mesh, frame]) each.frustumCulled = false;
    this.#group.add(mesh, frame);
    return { mesh, frame, size: "" };
  }
}

function filter(texture: THREE.Texture, smooth: boolean): void {
  texture.minFilter = THREE.LinearFilter;
  texture.magFilter = smooth ? THREE.LinearFilter : THREE.NearestFilter;
  texture.needsUpdate = true;
}
