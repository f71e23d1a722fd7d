// SPDX-License-Identifier: Apache-2.0
// What others make of a .glb of ours: the Khronos validator, and three.js playing it.
//
// usage: node check_glb.mjs FILE.glb SECONDS   (node_modules: see scripts/setup --tests)
// Prints one JSON object: the validator's issues, and of each mesh where three.js puts its vertices at that time, in LPS mm,
// its material, and the names of the nodes.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { AnimationMixer, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

const validator = createRequire(import.meta.url)("gltf-validator");
globalThis.self ??= globalThis;

const [file, seconds] = process.argv.slice(2);
const bytes = new Uint8Array(readFileSync(file));
const report = await validator.validateBytes(bytes, { maxIssues: 20 });
const gltf = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), "");

if (gltf.animations.length > 0) {
  const mixer = new AnimationMixer(gltf.scene);
  for (const clip of gltf.animations) mixer.clipAction(clip).play();
  mixer.setTime(Number(seconds));
}
gltf.scene.updateMatrixWorld(true);
const meshes = {};
const materials = {};
gltf.scene.traverse((object) => {
  if (!object.isMesh) return;
  if (object.isSkinnedMesh) object.skeleton.update();
  const at = new Vector3();
  const points = [];
  for (let i = 0; i < object.geometry.attributes.position.count; ++i) {
    object.getVertexPosition(i, at).applyMatrix4(object.matrixWorld);
    points.push([1000 * at.x, -1000 * at.z, 1000 * at.y]);
  }
  // three.js makes the names of its objects unique; the file's stand in its JSON.
  const name = gltf.parser.json.meshes[gltf.parser.associations.get(object).meshes].name;
  meshes[name] = points;
  const { name: called, transparent, opacity, color } = object.material;
  materials[name] = { name: called, transparent, opacity, color: color.toArray() };
});
console.log(
  JSON.stringify({
    issues: report.issues,
    animations: gltf.animations.map((clip) => ({ name: clip.name, seconds: clip.duration, tracks: clip.tracks.length })),
    meshes,
    materials,
    nodes: gltf.parser.json.nodes.map((node) => node.name),
  }),
);
