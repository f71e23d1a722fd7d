// SPDX-License-Identifier: Apache-2.0
// The posed tissues as files, by three.js' own exporters. glTF is metres and y up; STL is millimetres in the patient's LPS, as every
// other STL of ecorche.
import * as THREE from "three";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";
import { STLExporter } from "three/examples/jsm/exporters/STLExporter.js";
import type { Tissue } from "../state/app_state.js";
import { STRIDE, type Body } from "./body.js";
import { CAP_COLOR, lookOf } from "./palette.js";

/** Plain meshes in mm, LPS, with their normals, one per tissue; where the scan's border cuts it, its caps are one more, `NAME_cap`. */
export function meshesOf(body: Body, tissues: readonly Tissue[], opacity: (row: number) => number): THREE.Mesh[] {
  const { positions, topology } = body;
  if (!positions || !topology) throw new Error("there is no body yet");
  return tissues.flatMap((tissue) => {
    const range = body.range(tissue.row);
    if (!range || range.indexCount === 0) return [];
    const places = new Float32Array(range.vertexCount * 3);
    for (let vertex = 0; vertex < range.vertexCount; vertex++) {
      for (let axis = 0; axis < 3; axis++) {
        const number = positions.numbers[(range.firstVertex + vertex) * STRIDE + axis]!;
        places[3 * vertex + axis] = positions.low[axis]! + positions.step * number;
      }
    }
    const indices = topology.indices.subarray(range.firstIndex, range.firstIndex + range.indexCount).map((index) => index - range.firstVertex);
    const look = lookOf(tissue.name, tissue.group), strength = opacity(tissue.row);
    const mesh = (name: string, corners: Uint32Array, color: number, roughness: number) => {
      const geometry = new THREE.BufferGeometry();
      // Places of its own: who writes it may move them.
      geometry.setAttribute("position", new THREE.BufferAttribute(places.slice(), 3)).setIndex(new THREE.BufferAttribute(corners, 1));
      geometry.computeVertexNormals();
      const made = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, roughness, metalness: 0, opacity: strength, transparent: strength < 1 }));
      made.name = name;
      return made;
    };
    const isCap = body.isCap(tissue.row);
    if (!isCap) return [mesh(tissue.name, indices, look.color, look.roughness)];
    const part = (cap: boolean) => indices.filter((_, corner) => isCap(Math.floor(corner / 3)) === cap);
    return [mesh(tissue.name, part(false), look.color, look.roughness), mesh(`${tissue.name}_cap`, part(true), CAP_COLOR, 1)];
  });
}

export async function writeGlb(meshes: THREE.Mesh[]): Promise<Blob> {
  const scene = new THREE.Scene();
  const toMetres = new THREE.Matrix4().makeRotationX(-Math.PI / 2).scale(new THREE.Vector3(0.001, 0.001, 0.001));
  for (const mesh of meshes) {
    mesh.geometry.applyMatrix4(toMetres);
    scene.add(mesh);
  }
  const data = await new GLTFExporter().parseAsync(scene, { binary: true });
  return new Blob([data as ArrayBuffer], { type: "model/gltf-binary" });
}

export function writeStl(meshes: THREE.Mesh[]): Blob {
  const scene = new THREE.Scene();
  scene.add(...meshes);
  scene.updateMatrixWorld(true);
  const data = new STLExporter().parse(scene, { binary: true });
  return new Blob([data as unknown as BlobPart], { type: "model/stl" });
}
