// SPDX-License-Identifier: Apache-2.0
// What one sees of one's own hands: a handle for a controller, the joints of a hand, the ray that points, and a ball where it takes hold.
import * as THREE from "three";
import { REACH } from "./grip.js";
import type { Source } from "./sources.js";

const RAY = 1.6;
const JOINTS = 25;

class Wand {
  readonly group = new THREE.Group();
  readonly #handle = new THREE.Mesh(new THREE.CapsuleGeometry(0.017, 0.085, 6, 16).rotateX(Math.PI / 2), new THREE.MeshLambertMaterial({ color: 0x2b323b }));
  readonly #joints = new THREE.InstancedMesh(new THREE.SphereGeometry(1, 12, 8), new THREE.MeshLambertMaterial({ color: 0x8fb7d8 }), JOINTS);
  readonly #ray = new THREE.Mesh(rayGeometry(), new THREE.MeshBasicMaterial({ color: 0xffffff, vertexColors: true, transparent: true, depthWrite: false, toneMapped: false }));
  readonly #ball = new THREE.Mesh(new THREE.SphereGeometry(0.011, 16, 12), new THREE.MeshBasicMaterial({ depthTest: false, transparent: true, toneMapped: false }));

  constructor() {
    this.#handle.matrixAutoUpdate = false;
    this.#joints.frustumCulled = false;
    this.#ball.renderOrder = 150;
    this.group.add(this.#handle, this.#joints, this.#ray, this.#ball);
  }

  update(source: Source, joints: readonly THREE.Matrix4[], holds: boolean, near: boolean, accent: number): void {
    this.#handle.visible = source.grip !== null && !source.isHand;
    if (source.grip) this.#handle.matrix.copy(source.grip);
    this.#joints.count = joints.length;
    joints.forEach((matrix, at) => this.#joints.setMatrixAt(at, matrix));
    this.#joints.instanceMatrix.needsUpdate = true;
    this.#ball.visible = source.hold !== null && (holds || near);
    if (source.hold) this.#ball.position.copy(source.hold);
    this.#ball.material.color.set(holds ? accent : 0xffffff);
    this.#ball.material.opacity = holds ? 1 : 0.7;
    // Close to the body one takes hold, from afar one points.
    this.#ray.visible = source.ray !== null && !holds && !near && source.input.targetRayMode === "tracked-pointer";
    if (!source.ray) return;
    this.#ray.position.copy(source.ray.origin);
    this.#ray.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, -1), source.ray.direction);
  }

  dispose(): void {
    for (const mesh of [this.#handle, this.#joints, this.#ray, this.#ball]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.#joints.dispose();
  }
}

export class Wands {
  readonly group = new THREE.Group();
  #wands = new Map<XRInputSource, Wand>();

  update(sources: readonly Source[], frame: XRFrame, base: XRReferenceSpace, state: (source: Source) => { holds: boolean; near: boolean }, accent: number): void {
    for (const [input, wand] of this.#wands) {
      if (sources.some((source) => source.input === input)) continue;
      this.#wands.delete(input);
      this.group.remove(wand.group);
      wand.dispose();
    }
    for (const source of sources) {
      const wand = this.#wands.get(source.input) ?? this.#add(source.input);
      const { holds, near } = state(source);
      wand.update(source, source.input.hand ? jointsOf(source.input.hand, frame, base) : [], holds, near, accent);
    }
  }

  #add(input: XRInputSource): Wand {
    const wand = new Wand();
    this.#wands.set(input, wand);
    this.group.add(wand.group);
    return wand;
  }

  dispose(): void {
    for (const wand of this.#wands.values()) wand.dispose();
    this.#wands.clear();
  }
}

function jointsOf(hand: XRHand, frame: XRFrame, base: XRReferenceSpace): THREE.Matrix4[] {
  return [...hand.values()].flatMap((joint) => {
    const pose = frame.getJointPose?.(joint, base);
    return pose ? [new THREE.Matrix4().fromArray(pose.transform.matrix).scale(new THREE.Vector3().setScalar(pose.radius ?? REACH / 10))] : [];
  });
}

/** From the origin along -z, thin, and clear at its end. */
function rayGeometry(): THREE.BufferGeometry {
  const geometry = new THREE.CylinderGeometry(0.0006, 0.0018, RAY, 8, 1, true).translate(0, RAY / 2, 0).rotateX(-Math.PI / 2);
  const positions = geometry.getAttribute("position"), colors = new Float32Array(positions.count * 4);
  for (let at = 0; at < positions.count; at++) colors.set([1, 1, 1, positions.getZ(at) < -RAY / 2 ? 0 : 0.9], 4 * at);
  return geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
}
