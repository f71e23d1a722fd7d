// SPDX-License-Identifier: Apache-2.0
// The clipping plane's handle: a ring in the plane, an arrow that moves it, and a ball at the arrow's end that tilts it.
import * as THREE from "three";
import { Projector, three } from "../posing/projector.js";
import { add, dot, length, scale, subtract, unit, type Vec3 } from "../posing/rotation.js";
import type { PointerTool, ScenePointer } from "../scene/tools.js";
import type { Stage } from "../scene/stage.js";
import type { Store } from "../state/store.js";
import { kept, moved, normalOf, withNormal, type Clip } from "./clip.js";

type Part = "arrow" | "ball";
type Sight = ReturnType<Projector["sight"]>;

// Pixels of CSS.
const RADIUS = 46;
const ARROW = 92;
const REACH = 12;
const COLOR = 0xff8a1f;
const HELD = 0xffc36b;

/** How far along the line (point, direction) its nearest place to a line of sight is; null where both run the same way. */
export function alongAxis(sight: Sight, point: Vec3, direction: Vec3): number | null {
  const b = dot(sight.along, direction), between = subtract(sight.from, point), square = 1 - b * b;
  return square < 1e-4 ? null : (dot(between, direction) - b * dot(between, sight.along)) / square;
}

/** From the middle of a sphere to where a line of sight meets its near side, or passes nearest to it. */
export function onSphere(sight: Sight, center: Vec3, radius: number): Vec3 | null {
  const to = subtract(center, sight.from), along = dot(to, sight.along);
  const nearest = subtract(add(sight.from, scale(sight.along, along)), center), far = length(nearest);
  const back = far < radius ? Math.sqrt(radius * radius - far * far) : 0;
  return unit(subtract(nearest, scale(sight.along, back)));
}

export class ClipHandle implements PointerTool {
  readonly #group = new THREE.Group();
  readonly #projector: Projector;
  readonly #material = new THREE.MeshBasicMaterial({ color: COLOR, depthTest: false, transparent: true, toneMapped: false });
  #hovered = false;
  #held: { part: Part; clip: Clip; start: number } | null = null;

  constructor(private readonly stage: Stage, private readonly store: Store<{ clip: Clip }>) {
    this.#projector = new Projector(stage);
    // Made along z, one pixel of CSS long a unit.
    const shaft = new THREE.CylinderGeometry(1.6, 1.6, ARROW - 10, 12).rotateX(Math.PI / 2).translate(0, 0, (ARROW - 10) / 2);
    for (const geometry of [new THREE.TorusGeometry(RADIUS, 1.5, 8, 72), shaft, new THREE.SphereGeometry(8, 20, 14).translate(0, 0, ARROW)]) {
      const mesh = new THREE.Mesh(geometry, this.#material);
      mesh.frustumCulled = false;
      mesh.renderOrder = 95;
      this.#group.add(mesh);
    }
    stage.patient.add(this.#group);
    stage.onBeforeDraw(() => this.#place());
  }

  down(pointer: ScenePointer): boolean {
    const part = this.#hit(pointer);
    if (!part) return false;
    const { clip } = this.store.state;
    this.#held = { part, clip, start: alongAxis(this.#projector.sight(pointer.ray), clip.at, normalOf(clip)) ?? 0 };
    return true;
  }

  move(pointer: ScenePointer): void {
    if (!this.#held) return;
    const { part, clip, start } = this.#held, sight = this.#projector.sight(pointer.ray);
    if (part === "arrow") {
      const along = alongAxis(sight, clip.at, normalOf(clip));
      if (along !== null) this.store.set({ clip: moved(clip, along - start) });
      return;
    }
    const towards = onSphere(sight, clip.at, ARROW * this.#projector.mmPerPixel(clip.at));
    if (towards) this.store.set({ clip: withNormal(clip, scale(towards, clip.flipped ? 1 : -1)) });
  }

  up(): void {
    this.#held = null;
    this.stage.invalidate();
  }

  cancel(): void {
    if (this.#held) this.store.set({ clip: this.#held.clip });
    this.#held = null;
  }

  hover(pointer: ScenePointer): boolean {
    const over = this.#hit(pointer) !== null;
    if (over !== this.#hovered) {
      this.#hovered = over;
      this.stage.invalidate();
    }
    return over;
  }

  /** The arrow points to what is cut away: towards who looks in. */
  #tip(clip: Clip): Vec3 {
    return add(clip.at, scale(kept(clip), -ARROW * this.#projector.mmPerPixel(clip.at)));
  }

  #hit(pointer: ScenePointer): Part | null {
    const { clip } = this.store.state;
    if (!clip.on) return null;
    const from = this.#projector.toScreen(clip.at), to = this.#projector.toScreen(this.#tip(clip));
    if (Math.abs(from.depth) > 1) return null;
    const reach = pointer.event.pointerType === "touch" ? 2 * REACH : REACH;
    if (Math.hypot(pointer.x - to.x, pointer.y - to.y) < reach) return "ball";
    const dx = to.x - from.x, dy = to.y - from.y, square = Math.max(1, dx * dx + dy * dy);
    const t = Math.min(1, Math.max(0, ((pointer.x - from.x) * dx + (pointer.y - from.y) * dy) / square));
    return Math.hypot(pointer.x - from.x - t * dx, pointer.y - from.y - t * dy) < reach ? "arrow" : null;
  }

  #place(): void {
    const { clip } = this.store.state;
    this.#group.visible = clip.on;
    if (!clip.on) return;
    this.#group.position.copy(three(clip.at));
    this.#group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), three(scale(kept(clip), -1)));
    this.#group.scale.setScalar(this.#projector.mmPerPixel(clip.at));
    this.#material.color.set(this.#hovered || this.#held ? HELD : COLOR);
  }
}
