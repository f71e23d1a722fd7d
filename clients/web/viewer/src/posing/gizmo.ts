// SPDX-License-Identifier: Apache-2.0
// The rings of a joint as they are drawn: a ring an angle, the arc that its limits leave, within it a thinner one where the body stays one,
// how far it has turned, and a handle.

import * as THREE from "three";
import { directionAt, type Ring } from "./ring.js";
import { add, cross, scale, type Vec3 } from "./rotation.js";
import { three } from "./projector.js";

/** By the axis of the joint's frame: vermilion, green, blue, which colour-blind people tell apart too. */
export const RING_COLORS = [0xe8632b, 0x1fa67a, 0x3d8bff] as const;
const IDLE = 0x8d939c;

/** Of the first ring, pixels of CSS; the others lie outside of it. */
const RADIUS = 78;
const GROWTH = [1, 1.2, 1.4] as const;

// What lies behind the joint, as the viewer sees it, is fainter: so that one sees which way a ring leans.
const VERTEX = /* glsl */ `
uniform vec3 middle;
uniform float reach;
varying float vNear;
void main() {
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  vec4 center = viewMatrix * vec4(middle, 1.0);
  vNear = clamp(0.5 + 0.5 * (view.z - center.z) / max(reach, 1e-6), 0.0, 1.0);
  gl_Position = projectionMatrix * view;
}
`;
const FRAGMENT = /* glsl */ `
uniform vec3 color;
uniform float opacity;
varying float vNear;
void main() {
  gl_FragColor = vec4(color, opacity * mix(0.3, 1.0, smoothstep(0.35, 0.6, vNear)));
  #include <colorspace_fragment>
}
`;

interface Shared {
  readonly middle: { value: THREE.Vector3 };
  readonly reach: { value: number };
}

function ink(shared: Shared, opacity: number): THREE.ShaderMaterial {
  return new THREE.ShaderMaterial({
    vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthTest: false, depthWrite: false, side: THREE.DoubleSide,
    toneMapped: false,
    uniforms: { color: { value: new THREE.Color(IDLE) }, opacity: { value: opacity }, middle: shared.middle, reach: shared.reach },
  });
}

const SECTOR_STEPS = 360;
/** Of the arc within a ring that shows its safe range, over the ring's. */
const SAFE_RADIUS = 0.92;

/** One ring; its geometry is of radius 1 about z, from x on. */
class RingDrawing {
  readonly group = new THREE.Group();
  #whole: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #edge: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #arc: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #sector: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #handle: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #rim: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>;
  #stops: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>[] = [];
  #safe: THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial> | null = null;

  constructor(ring: Ring, shared: Shared) {
    const span = Math.min(ring.to - ring.from, 2 * Math.PI);
    const mesh = (geometry: THREE.BufferGeometry, opacity: number, order: number) => {
      const made = new THREE.Mesh(geometry, ink(shared, opacity));
      made.matrixAutoUpdate = false;
      made.frustumCulled = false;
      made.renderOrder = 100 + order;
      this.group.add(made);
      return made;
    };
    this.#sector = mesh(new THREE.CircleGeometry(1, SECTOR_STEPS), 0.22, 0);
    this.#whole = mesh(new THREE.TorusGeometry(1, 0.008, 6, 128), 0.35, 1);
    this.#edge = mesh(new THREE.TorusGeometry(1, 0.036, 8, 128, span), 0.6, 2);
    this.#arc = mesh(new THREE.TorusGeometry(1, 0.022, 8, 128, span), 1, 3);
    if (ring.safe) {
      this.#safe = mesh(new THREE.TorusGeometry(SAFE_RADIUS, 0.012, 6, 96, Math.min(ring.safe.to - ring.safe.from, 2 * Math.PI)), 0.9, 3);
    }
    if (ring.limited) this.#stops = [0, 1].map(() => mesh(new THREE.BoxGeometry(0.16, 0.035, 0.035), 1, 4));
    this.#rim = mesh(new THREE.SphereGeometry(0.1, 24, 16), 1, 5);
    this.#handle = mesh(new THREE.SphereGeometry(0.075, 24, 16), 1, 6);
  }

  place(ring: Ring, radius: number, look: { color: THREE.Color; paper: THREE.Color; strong: boolean; atLimit: boolean }): void {
    const at = (direction: Vec3, middle: Vec3, size: number): THREE.Matrix4 =>
      new THREE.Matrix4().makeBasis(three(direction), three(cross(ring.axis, direction)), three(ring.axis))
        .scale(new THREE.Vector3(size, size, size)).setPosition(three(middle));
    const set = (mesh: THREE.Mesh, matrix: THREE.Matrix4) => {
      mesh.matrix.copy(matrix);
      mesh.matrixWorldNeedsUpdate = true;
    };
    const from = directionAt(ring, ring.from);
    set(this.#whole, at(from, ring.center, radius));
    set(this.#edge, at(from, ring.center, radius));
    set(this.#arc, at(from, ring.center, radius));
    if (this.#safe && ring.safe) {
      set(this.#safe, at(directionAt(ring, ring.safe.from), ring.center, radius));
      this.#safe.material.uniforms["color"]!.value = look.color;
    }
    const low = Math.min(ring.rest, ring.value), turned = Math.abs(ring.value - ring.rest);
    set(this.#sector, at(directionAt(ring, low), ring.center, radius));
    this.#sector.geometry.setDrawRange(0, 3 * Math.min(SECTOR_STEPS, Math.round((turned / (2 * Math.PI)) * SECTOR_STEPS)));
    const on = (angle: number) => {
      const direction = directionAt(ring, angle);
      return at(direction, add(ring.center, scale(direction, radius)), radius);
    };
    this.#stops.forEach((stop, i) => set(stop, on(i === 0 ? ring.from : ring.to)));
    for (const ball of [this.#rim, this.#handle]) set(ball, on(ring.value));
    for (const mesh of [this.#whole, this.#arc, this.#sector, this.#handle, ...this.#stops]) mesh.material.uniforms["color"]!.value = look.color;
    this.#edge.material.uniforms["color"]!.value = look.paper;
    this.#rim.material.uniforms["color"]!.value = look.paper;
    this.#handle.material.uniforms["color"]!.value = look.atLimit ? look.paper : look.color;
    this.#rim.material.uniforms["color"]!.value = look.atLimit ? look.color : look.paper;
    this.#sector.material.uniforms["opacity"]!.value = look.strong ? 0.42 : 0.26;
    this.#arc.material.uniforms["opacity"]!.value = look.strong ? 1 : 0.85;
  }

  dispose(): void {
    for (const mesh of this.group.children as THREE.Mesh<THREE.BufferGeometry, THREE.ShaderMaterial>[]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}

export interface GizmoLook {
  /** Index of the ring under the pointer, or held; -1: none. */
  readonly active: number;
  /** Poses are taken; else it is grey. */
  readonly live: boolean;
  /** Of rims and edges: the page's ground. */
  readonly paper: number;
}

export class Gizmo {
  /** Child of Stage.patient: mm, LPS. */
  readonly group = new THREE.Group();
  #drawings: RingDrawing[] = [];
  #key = "";
  #shared: Shared = { middle: { value: new THREE.Vector3() }, reach: { value: 1 } };

  /** `colors`: of each ring, the axis of the joint's frame. `mmPerPixel` at the joint. */
  update(rings: readonly Ring[], axes: readonly number[], key: string, mmPerPixel: number, look: GizmoLook): void {
    if (key !== this.#key) {
      this.clear();
      this.#key = key;
      this.#drawings = rings.map((ring) => new RingDrawing(ring, this.#shared));
      for (const drawing of this.#drawings) this.group.add(drawing.group);
    }
    if (rings.length === 0) return;
    const parent = this.group.parent;
    this.#shared.middle.value.copy(three(rings[0]!.center)).applyMatrix4(parent?.matrix ?? new THREE.Matrix4());
    this.#shared.reach.value = (RADIUS * mmPerPixel) / 1000;
    rings.forEach((ring, i) => {
      const tolerance = 1e-6;
      this.#drawings[i]!.place(ring, radiusOf(i) * mmPerPixel, {
        color: new THREE.Color(look.live ? RING_COLORS[axes[i]!]! : IDLE), paper: new THREE.Color(look.paper), strong: look.active === i,
        atLimit: ring.limited && (ring.value <= ring.from + tolerance || ring.value >= ring.to - tolerance),
      });
    });
  }

  clear(): void {
    for (const drawing of this.#drawings) {
      this.group.remove(drawing.group);
      drawing.dispose();
    }
    this.#drawings = [];
    this.#key = "";
  }
}

/** Of ring `i` of a joint, pixels of CSS. */
export const radiusOf = (i: number): number => RADIUS * GROWTH[i]!;
