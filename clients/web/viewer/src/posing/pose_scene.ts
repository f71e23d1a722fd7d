// SPDX-License-Identifier: Apache-2.0
// What posing adds to the picture: rings at the chosen joint, dots at all, the line of a pull, and words beside them.

import * as THREE from "three";
import type { Stage } from "../scene/stage.js";
import type { BodyDrag } from "./body_drag.js";
import { placeJoint } from "./forward.js";
import { Gizmo, radiusOf, RING_COLORS } from "./gizmo.js";
import { JointDots, type DotKind } from "./joint_dots.js";
import { Overlay, type Label } from "./overlay.js";
import type { Poser } from "./poser.js";
import { Projector, three, type ScreenPoint } from "./projector.js";
import { directionAt, limbDirections, ringsOf, type Ring } from "./ring.js";
import { add, IDENTITY, scale, type Vec3 } from "./rotation.js";
import type { Rig } from "./rig.js";
import { jointLabel, spoken } from "./words.js";

export interface RingHit {
  readonly kind: "ring";
  readonly index: number;
  readonly ring: Ring;
  /** On the screen, px that the ring's place under the pointer moves by a radian. */
  readonly tangent: readonly [number, number];
}

export interface DotHit {
  readonly kind: "dot";
  readonly row: number;
  readonly center: Vec3;
}

export type Hit = RingHit | DotHit;

/** Colours of the page's theme, sRGB. */
export interface SceneColors {
  readonly paper: number;
  readonly idle: number;
  readonly accent: number;
}

const STEPS = 120;

export class PoseScene {
  readonly overlay = new Overlay();
  readonly projector: Projector;
  shown = true;
  colors: SceneColors = { paper: 0xffffff, idle: 0x39424e, accent: 0xffb300 };
  #gizmo = new Gizmo();
  #dots = new JointDots();
  #line: THREE.Line<THREE.BufferGeometry, THREE.LineBasicMaterial>;
  #rings: readonly Ring[] = [];
  #centers: readonly { row: number; center: Vec3 }[] = [];
  #limbs: { rig: Rig; directions: readonly Vec3[] } | null = null;
  #hovered: Hit | null = null;

  constructor(private readonly stage: Stage, private readonly poser: Poser, private readonly drag: BodyDrag) {
    this.projector = new Projector(stage);
    this.#line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ depthTest: false, transparent: true, toneMapped: false }));
    this.#line.frustumCulled = false;
    this.#line.renderOrder = 97;
    stage.patient.add(this.#gizmo.group, this.#dots.points, this.#line);
    stage.canvas.parentElement!.append(this.overlay.root);
    stage.onBeforeDraw(() => this.#draw());
    poser.store.watch((state) => state, () => stage.invalidate());
    drag.store.watch((state) => state.pull, () => stage.invalidate());
  }

  /** What is under or held by the pointer. */
  hover(hit: Hit | null): void {
    if (hit?.kind === this.#hovered?.kind && key(hit) === key(this.#hovered)) return;
    this.#hovered = hit;
    this.stage.invalidate();
  }

  /** Rings before dots, handles before rings; `reach` in pixels: more for a finger than for a mouse. */
  hit(x: number, y: number, reach: number): Hit | null {
    if (!this.shown) return null;
    return this.#hitRing(x, y, reach) ?? this.#hitDot(x, y, reach);
  }

  #hitRing(x: number, y: number, reach: number): RingHit | null {
    let best: { index: number; far: number; angle: number } | null = null;
    this.#rings.forEach((ring, index) => {
      const consider = (angle: number, bonus: number) => {
        const at = this.#onRing(ring, index, angle);
        const far = Math.hypot(at.x - x, at.y - y) - bonus;
        if (Math.abs(at.depth) <= 1 && far < (best?.far ?? reach)) best = { index, far, angle };
      };
      consider(ring.value, 8);
      for (let i = 0; i < STEPS; i++) consider(ring.value + (2 * Math.PI * i) / STEPS, 0);
    });
    if (!best) return null;
    const { index, angle } = best as { index: number; angle: number };
    const ring = this.#rings[index]!;
    const delta = 0.02;
    const before = this.#onRing(ring, index, angle - delta), after = this.#onRing(ring, index, angle + delta);
    return { kind: "ring", index, ring, tangent: [(after.x - before.x) / (2 * delta), (after.y - before.y) / (2 * delta)] };
  }

  #hitDot(x: number, y: number, reach: number): DotHit | null {
    let best: DotHit | null = null, least = reach;
    for (const { row, center } of this.#centers) {
      const at = this.projector.toScreen(center);
      const far = Math.hypot(at.x - x, at.y - y);
      if (Math.abs(at.depth) > 1 || far >= least) continue;
      least = far;
      best = { kind: "dot", row, center };
    }
    return best;
  }

  /** Of the chosen joint: where its ring is in the picture, so many radians from its handle. */
  placeOnRing(index: number, turn: number): ScreenPoint | null {
    const ring = this.#rings[index];
    return ring ? this.#onRing(ring, index, ring.value + turn) : null;
  }

  #onRing(ring: Ring, index: number, angle: number): ScreenPoint {
    const radius = radiusOf(index) * this.projector.mmPerPixel(ring.center);
    return this.projector.toScreen(add(ring.center, scale(directionAt(ring, angle), radius)));
  }

  #draw(): void {
    const { rig, body, motions, joint, controls, pins } = this.poser.state;
    const visible = this.shown && rig !== null;
    this.#gizmo.group.visible = this.#dots.points.visible = visible;
    this.#drawPull();
    if (!visible) {
      this.#rings = [];
      this.#centers = [];
      this.overlay.show(this.#pullLabel());
      return;
    }
    if (this.#limbs?.rig !== rig) this.#limbs = { rig, directions: limbDirections(rig) };
    const placed = rig.segments.map((_, row) => placeJoint(rig, body, motions, row));
    this.#centers = rig.segments.flatMap((segment, row) => (segment.joint.kind === "fixed" ? [] : [{ row, center: placed[row]!.center }]));
    const kind = (row: number): DotKind => pins.some((pin) => pin.segment === row) ? "pinned"
      : row === joint ? "chosen" : this.#hovered?.kind === "dot" && this.#hovered.row === row ? "hovered" : "plain";
    this.#dots.update(this.#centers.map((c) => c.center), this.#centers.map((c) => kind(c.row)), this.stage.renderer.getPixelRatio(), this.colors);
    if (joint === null) {
      this.#rings = [];
      this.#gizmo.clear();
    } else {
      const { parent } = rig.segments[joint]!;
      this.#rings = ringsOf(rig, joint, placed[joint]!, this.#limbs.directions[joint]!, parent < 0 ? IDENTITY : motions[parent]!.q);
      const axes = this.#rings.map((ring) => rig.segments[joint]!.joint.sequence[ring.angle]!.axis);
      const mm = this.projector.mmPerPixel(placed[joint]!.center);
      const active = this.#hovered?.kind === "ring" ? this.#hovered.index : -1;
      this.#gizmo.update(this.#rings, axes, `${rig.name}.${joint}.${this.#rings.map((r) => r.limited).join()}`, mm, { active, live: controls, paper: this.colors.paper });
    }
    this.overlay.show([...this.#ringLabels(rig, controls), ...this.#dotLabel(rig), ...this.#pullLabel()]);
  }

  #ringLabels(rig: Rig, controls: boolean): Label[] {
    const joint = this.poser.state.joint;
    if (joint === null) return [];
    const middle = this.#rings[0] ? this.projector.toScreen(this.#rings[0].center).x : 0;
    return this.#rings.map((ring, index) => {
      const at = this.#onRing(ring, index, ring.value);
      const axis = rig.segments[joint]!.joint.sequence[ring.angle]!.axis;
      const held = this.#hovered?.kind === "ring" && this.#hovered.index === index;
      const limit = ring.limited && (ring.value <= ring.from + 1e-6 || ring.value >= ring.to - 1e-6) ? " (limit)" : "";
      return {
        text: spoken(ring.name, ring.value) + limit, x: at.x, y: at.y, left: at.x < middle - 4,
        kind: `${controls ? `ring-${"xyz"[axis]}` : "idle"}${held ? " held" : ""}`,
      };
    });
  }

  #dotLabel(rig: Rig): Label[] {
    if (this.#hovered?.kind !== "dot" || this.drag.store.state.pull) return [];
    const { row } = this.#hovered;
    const center = this.#centers.find((c) => c.row === row)?.center;
    if (!center) return [];
    const at = this.projector.toScreen(center);
    return [{ text: jointLabel(rig.segments[row]!.joint), x: at.x, y: at.y, left: false, kind: "dot" }];
  }

  #drawPull(): void {
    const { pull } = this.drag.store.state;
    this.#line.visible = pull !== null && pull.residual > 0.5;
    if (!pull) return;
    this.#line.geometry.setFromPoints([three(pull.reached), three(pull.target)]);
    this.#line.material.color.set(RING_COLORS[0]);
  }

  #pullLabel(): Label[] {
    const { pull } = this.drag.store.state;
    if (!pull) return [];
    const at = this.projector.toScreen(pull.target);
    const text = pull.residual < 1 ? "Reached" : `${Math.round(pull.residual)} mm short`;
    return [{ text, x: at.x, y: at.y, left: false, kind: pull.residual < 1 ? "dot" : "short" }];
  }
}

const key = (hit: Hit | null): number => (!hit ? -1 : hit.kind === "ring" ? hit.index : hit.row);
