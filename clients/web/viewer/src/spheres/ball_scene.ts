// SPDX-License-Identifier: Apache-2.0
// Balls, tree and joints in the picture, posed as the body is: a point of the ball's size each, shaded as a ball, in the colour of what it
// hangs on.
import * as THREE from "three";
import type { Motion } from "../posing/forward.js";
import { move } from "../posing/forward.js";
import { three } from "../posing/projector.js";
import type { Vec3 } from "../posing/rotation.js";
import type { Stage } from "../scene/stage.js";
import type { HangingState } from "./hanging.js";
import { radiiOf } from "./hanging.js";
import { placesOf } from "./vtp.js";

export interface Parts {
  readonly balls: boolean;
  readonly tree: boolean;
  readonly joints: boolean;
}

const PICKED = new THREE.Color(0xfff04a);
/** Of a segment: neighbours in the rig are far from each other on the circle of colours. */
export const colorOf = (segment: number): THREE.Color => new THREE.Color().setHSL((segment * 0.381966) % 1, 0.62, 0.52);

const VERTEX = /* glsl */ `
attribute float radius;
attribute vec3 tint;
uniform float pixels;   // of a length of one at a distance of one
varying vec3 vTint;
void main() {
  vTint = tint;
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * at;
  gl_PointSize = clamp(0.002 * radius * pixels / max(-at.z, 1e-3), 3.0, 200.0);
}`;
const FRAGMENT = /* glsl */ `
varying vec3 vTint;
void main() {
  vec2 at = 2.0 * gl_PointCoord - 1.0;
  float square = dot(at, at);
  if (square > 1.0) discard;
  gl_FragColor = vec4(vTint * (0.45 + 0.55 * sqrt(1.0 - square)), 1.0);
  #include <colorspace_fragment>
}`;

export class BallScene {
  readonly #group = new THREE.Group();
  readonly #balls: THREE.Points<THREE.BufferGeometry, THREE.ShaderMaterial>;
  readonly #tree = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.5, depthTest: false, toneMapped: false }));
  readonly #joints = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: 0xff3df0, size: 11, sizeAttenuation: false, depthTest: false, transparent: true, toneMapped: false }));
  #rest: Float32Array = new Float32Array();
  /** mm, LPS, posed, 3 for each ball and each joint; mm. */
  places: Float32Array = new Float32Array();
  radii: Float32Array = new Float32Array();
  jointPlaces: readonly Vec3[] = [];
  #of: HangingState["spheres"] = null;

  constructor(private readonly stage: Stage) {
    this.#balls = new THREE.Points(new THREE.BufferGeometry(), new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, toneMapped: false, uniforms: { pixels: { value: 1 } } }));
    // Before glass, so that they are seen through it.
    this.#balls.renderOrder = 3;
    this.#tree.renderOrder = 90;
    this.#joints.renderOrder = 91;
    for (const each of [this.#balls, this.#tree, this.#joints]) {
      each.frustumCulled = false;
      this.#group.add(each);
    }
    stage.patient.add(this.#group);
    stage.onBeforeDraw(() => {
      const height = stage.renderer.getDrawingBufferSize(new THREE.Vector2()).y;
      this.#balls.material.uniforms["pixels"]!.value = height / (2 * Math.tan(THREE.MathUtils.degToRad(stage.camera.fov / 2)));
    });
  }

  setParts({ balls, tree, joints }: Parts): void {
    this.#balls.visible = balls;
    this.#tree.visible = tree;
    this.#joints.visible = joints;
    this.stage.invalidate();
  }

  /** `motions`: of the segments, with the joints where they were moved to. */
  show({ spheres, segment, joints, picked }: HangingState, motions: readonly Motion[], parents: readonly number[]): void {
    this.#group.visible = spheres !== null;
    this.stage.invalidate();
    if (!spheres) return;
    if (this.#of !== spheres) {
      this.#of = spheres;
      this.#rest = placesOf(spheres);
      this.radii = radiiOf(spheres);
      this.places = new Float32Array(this.#rest.length);
      this.#balls.geometry.dispose();
      this.#balls.geometry = new THREE.BufferGeometry();
      this.#balls.geometry.setAttribute("position", new THREE.BufferAttribute(this.places, 3));
      this.#balls.geometry.setAttribute("radius", new THREE.BufferAttribute(this.radii, 1));
      this.#balls.geometry.setAttribute("tint", new THREE.BufferAttribute(new Float32Array(this.#rest.length), 3));
      this.#tree.geometry.dispose();
      this.#tree.geometry = new THREE.BufferGeometry();
      this.#tree.geometry.setAttribute("position", this.#balls.geometry.getAttribute("position"));
      const { parent } = spheres;
      this.#tree.geometry.setIndex(parent ? Array.from(parent.keys()).filter((row) => parent[row]! >= 0).flatMap((row) => [row, parent[row]!]) : []);
    }
    const tint = this.#balls.geometry.getAttribute("tint") as THREE.BufferAttribute, colors = motions.map((_, row) => colorOf(row));
    for (let ball = 0; ball < segment.length; ++ball) {
      const at = 3 * ball, motion = motions[segment[ball]!];
      const rest: Vec3 = [this.#rest[at]!, this.#rest[at + 1]!, this.#rest[at + 2]!];
      this.places.set(motion ? move(motion, rest) : rest, at);
      const color = picked.has(ball) ? PICKED : colors[segment[ball]!] ?? PICKED;
      tint.setXYZ(ball, color.r, color.g, color.b);
    }
    tint.needsUpdate = true;
    this.#balls.geometry.getAttribute("position").needsUpdate = true;
    // A joint goes with the segment that it hangs on.
    this.jointPlaces = motions.map((own, row) => move(motions[parents[row]!] ?? own, [joints[3 * row]!, joints[3 * row + 1]!, joints[3 * row + 2]!]));
    this.#joints.geometry.setFromPoints(this.jointPlaces.map(three));
  }
}
