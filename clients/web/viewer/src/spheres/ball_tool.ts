// SPDX-License-Identifier: Apache-2.0
// The pointer on balls and joints: one ball, a box round many, a brush over them, or a joint that is drawn elsewhere.
import { h } from "../panels/dom.js";
import { Projector } from "../posing/projector.js";
import type { Vec3 } from "../posing/rotation.js";
import type { PointerTool, ScenePointer } from "../scene/tools.js";
import type { Stage } from "../scene/stage.js";
import type { BallScene } from "./ball_scene.js";

export type BallPick = "off" | "single" | "box" | "brush" | "joint";

export interface BallActions {
  chosen(): BallPick;
  pick(rows: number[], how: "replace" | "add" | "remove"): void;
  /** Posed, mm, LPS. */
  moveJoint(row: number, place: Vec3): void;
}

const BRUSH_PIXELS = 22;
const JOINT_PIXELS = 12;

interface Held {
  readonly tool: BallPick;
  readonly x: number;
  readonly y: number;
  readonly joint: number;
}

export class BallTool implements PointerTool {
  readonly #projector: Projector;
  readonly #box = h("div", { class: "pick-box", hidden: true });
  #held: Held | null = null;
  /** Pixels of every ball and joint, made when the pointer goes down. */
  #screen = new Float32Array();

  constructor(stage: Stage, private readonly scene: BallScene, private readonly actions: BallActions) {
    this.#projector = new Projector(stage);
    stage.canvas.parentElement!.append(this.#box);
  }

  down(pointer: ScenePointer): boolean {
    const tool = this.actions.chosen();
    if (tool === "off" || this.scene.places.length === 0) return false;
    if (tool === "joint") {
      const joint = this.#jointAt(pointer.x, pointer.y);
      if (joint < 0) return false;
      this.#held = { tool, x: pointer.x, y: pointer.y, joint };
      return true;
    }
    this.#project();
    const how = pointer.event.altKey ? "remove" : pointer.event.metaKey ? "add" : "replace";
    if (tool === "single") {
      const ball = this.#ballAt(pointer.x, pointer.y);
      if (ball < 0) return false;
      this.actions.pick([ball], how === "replace" ? "add" : how);
      this.#held = { tool: "off", x: pointer.x, y: pointer.y, joint: -1 };
      return true;
    }
    this.#held = { tool, x: pointer.x, y: pointer.y, joint: -1 };
    if (tool === "brush") this.#brush(pointer);
    else this.#showBox(pointer.x, pointer.y);
    return true;
  }

  move(pointer: ScenePointer): void {
    const held = this.#held;
    if (held?.tool === "brush") this.#brush(pointer);
    if (held?.tool === "box") this.#showBox(pointer.x, pointer.y);
    if (held?.tool === "joint") {
      const at = this.#projector.acrossFrom(this.scene.jointPlaces[held.joint]!, this.#projector.sight(pointer.ray));
      if (at) this.actions.moveJoint(held.joint, at);
    }
  }

  up(pointer: ScenePointer): void {
    const held = this.#held;
    this.cancel();
    if (held?.tool !== "box") return;
    const [left, right] = [held.x, pointer.x].sort((a, b) => a - b), [top, bottom] = [held.y, pointer.y].sort((a, b) => a - b);
    const rows = this.#rows((x, y) => x >= left! && x <= right! && y >= top! && y <= bottom!);
    this.actions.pick(rows, pointer.event.altKey ? "remove" : "add");
  }

  cancel(): void {
    this.#held = null;
    this.#box.hidden = true;
  }

  hover(): boolean {
    return this.actions.chosen() !== "off" && this.scene.places.length > 0;
  }

  #brush(pointer: ScenePointer): void {
    const rows = this.#rows((x, y) => Math.hypot(x - pointer.x, y - pointer.y) <= BRUSH_PIXELS);
    if (rows.length > 0) this.actions.pick(rows, pointer.event.altKey ? "remove" : "add");
  }

  #rows(within: (x: number, y: number) => boolean): number[] {
    const rows: number[] = [];
    for (let row = 0; 4 * row < this.#screen.length; ++row) if (within(this.#screen[4 * row]!, this.#screen[4 * row + 1]!)) rows.push(row);
    return rows;
  }

  /** The nearest to the eye whose disc is there. */
  #ballAt(x: number, y: number): number {
    let best = -1;
    for (let row = 0; 4 * row < this.#screen.length; ++row) {
      const at = 4 * row, off = Math.hypot(this.#screen[at]! - x, this.#screen[at + 1]! - y);
      if (off <= Math.max(2, this.#screen[at + 3]!) && (best < 0 || this.#screen[at + 2]! < this.#screen[4 * best + 2]!)) best = row;
    }
    return best;
  }

  #jointAt(x: number, y: number): number {
    let best = -1, least = JOINT_PIXELS;
    this.scene.jointPlaces.forEach((place, row) => {
      const at = this.#projector.toScreen(place), off = Math.hypot(at.x - x, at.y - y);
      if (Math.abs(at.depth) > 1 || off > least) return;
      least = off;
      best = row;
    });
    return best;
  }

  /** x, y, depth and radius in pixels. */
  #project(): void {
    const { places, radii } = this.scene;
    this.#screen = new Float32Array(4 * radii.length);
    for (let row = 0; row < radii.length; ++row) {
      const place: Vec3 = [places[3 * row]!, places[3 * row + 1]!, places[3 * row + 2]!], { x, y, depth } = this.#projector.toScreen(place);
      this.#screen.set([x, y, depth, radii[row]! / this.#projector.mmPerPixel(place)], 4 * row);
    }
  }

  #showBox(x: number, y: number): void {
    const held = this.#held!, { style } = this.#box;
    style.left = `${Math.min(held.x, x)}px`;
    style.top = `${Math.min(held.y, y)}px`;
    style.width = `${Math.abs(x - held.x)}px`;
    style.height = `${Math.abs(y - held.y)}px`;
    this.#box.hidden = false;
  }
}

