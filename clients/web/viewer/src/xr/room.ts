// SPDX-License-Identifier: Apache-2.0
// What stands round the body: its shadow, and where no room is seen a floor of square metres that fades away. Light for what one holds.
import * as THREE from "three";
import { ground } from "../scene/ground.js";
import type { Surroundings } from "../scene/stage.js";
import type { Stand } from "./stand.js";

const FLOOR = 8;

export class Room {
  readonly group = new THREE.Group();
  readonly #shadow = ground();

  /** `radius`: of the body's trunk at its own size, m. */
  constructor(colors: Surroundings, private readonly radius: number, open: boolean) {
    this.group.add(new THREE.HemisphereLight(0xffffff, 0x8890a0, 2.4), this.#shadow.mesh);
    this.#shadow.setColor(colors.shadow);
    if (!open) this.group.add(floor(colors));
  }

  follow({ position, scale }: Stand): void {
    this.#shadow.place(position.x, 0.004, position.z, this.radius * scale);
  }
}

function floor(colors: Surroundings): THREE.Mesh {
  const material = new THREE.ShaderMaterial({
    transparent: true, depthWrite: false, toneMapped: false,
    uniforms: { line: { value: new THREE.Color(colors.shadow) } },
    vertexShader: "varying vec2 at; void main() { at = position.xz; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
    fragmentShader: /* glsl */ `
      uniform vec3 line;
      varying vec2 at;
      void main() {
        vec2 away = abs(fract(at - 0.5) - 0.5), width = max(fwidth(at), vec2(1e-5));
        vec2 lines = 1.0 - smoothstep(vec2(0.0), width * 1.2, away - 0.004);
        float shown = max(lines.x, lines.y) * (1.0 - smoothstep(0.3, 1.0, length(at) / ${FLOOR}.0));
        gl_FragColor = vec4(line, shown * 0.35);
        #include <colorspace_fragment>
      }`,
  });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2 * FLOOR, 2 * FLOOR).rotateX(-Math.PI / 2), material);
  mesh.renderOrder = -60;
  return mesh;
}
