// SPDX-License-Identifier: Apache-2.0
// A dot at every joint: a click chooses it, a pull moves the limb by it. Always of one size on the screen, over the body.

import * as THREE from "three";
import type { Vec3 } from "./rotation.js";

const VERTEX = /* glsl */ `
attribute float kind;
uniform float scale;
varying float vKind;
void main() {
  vKind = kind;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = scale * (kind > 0.5 ? 17.0 : 11.0);
}
`;

// A disc with a rim; what is pinned is a square.
const FRAGMENT = /* glsl */ `
uniform vec3 paper;
uniform vec3 idle;
uniform vec3 accent;
varying float vKind;
void main() {
  vec2 at = gl_PointCoord * 2.0 - 1.0;
  float far = vKind > 2.5 ? max(abs(at.x), abs(at.y)) * 1.12 : length(at);
  float edge = fwidth(far);
  float inside = 1.0 - smoothstep(1.0 - edge, 1.0, far);
  if (inside <= 0.0) discard;
  float core = 1.0 - smoothstep(0.68 - edge, 0.68, far);
  vec3 fill = vKind > 0.5 ? accent : idle;
  gl_FragColor = vec4(mix(paper, fill, core), inside * (vKind > 0.5 ? 1.0 : 0.85));
  #include <colorspace_fragment>
}
`;

export type DotKind = "plain" | "hovered" | "chosen" | "pinned";
const KINDS: Readonly<Record<DotKind, number>> = { plain: 0, hovered: 1, chosen: 2, pinned: 3 };

export class JointDots {
  readonly points: THREE.Points<THREE.BufferGeometry, THREE.ShaderMaterial>;

  constructor() {
    const material = new THREE.ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthTest: false, depthWrite: false, toneMapped: false,
      uniforms: {
        scale: { value: 1 }, paper: { value: new THREE.Color(0xffffff) }, idle: { value: new THREE.Color(0x39424e) },
        accent: { value: new THREE.Color(0xffb300) },
      },
    });
    this.points = new THREE.Points(new THREE.BufferGeometry(), material);
    this.points.frustumCulled = false;
    this.points.renderOrder = 98;
  }

  update(centers: readonly Vec3[], kinds: readonly DotKind[], pixelRatio: number, colors: { paper: number; idle: number; accent: number }): void {
    const { geometry, material } = this.points;
    const position = geometry.getAttribute("position") as THREE.BufferAttribute | undefined;
    if (!position || position.count !== centers.length) {
      geometry.dispose();
      this.points.geometry = new THREE.BufferGeometry();
      this.points.geometry.setAttribute("position", new THREE.Float32BufferAttribute(centers.flat(), 3));
      this.points.geometry.setAttribute("kind", new THREE.Float32BufferAttribute(kinds.map((k) => KINDS[k]), 1));
    } else {
      const kind = geometry.getAttribute("kind") as THREE.BufferAttribute;
      centers.forEach((c, i) => position.setXYZ(i, c[0], c[1], c[2]));
      kinds.forEach((k, i) => kind.setX(i, KINDS[k]));
      position.needsUpdate = kind.needsUpdate = true;
    }
    material.uniforms["scale"]!.value = pixelRatio;
    for (const name of ["paper", "idle", "accent"] as const) (material.uniforms[name]!.value as THREE.Color).set(colors[name]);
  }
}
