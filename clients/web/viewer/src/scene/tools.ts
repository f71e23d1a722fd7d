// SPDX-License-Identifier: Apache-2.0
// Who gets the pointer: tools in turn (a gizmo, a drag of a hand), then the choice of a tissue, and else the camera.
import * as THREE from "three";
import type { Picked, Picker } from "./picker.js";
import type { Stage } from "./stage.js";

export interface ScenePointer {
  /** Pixels of CSS from the upper left of the picture. */
  readonly x: number;
  readonly y: number;
  /** In the scene: metres, y up. */
  readonly ray: THREE.Ray;
  readonly event: PointerEvent;
  /** The tissue below; draws the body once, so ask only when it matters. */
  pick(): Picked | null;
}

export interface PointerTool {
  /** True takes the pointer until it goes up: the camera keeps still. */
  down(pointer: ScenePointer): boolean;
  /** While it is taken. */
  move(pointer: ScenePointer): void;
  up(pointer: ScenePointer): void;
  /** The pointer is lost, or Escape: as if nothing had been done. */
  cancel(): void;
  /** The pointer passes by with no button down; true: the tool shows something of its own there, and no tissue is named. */
  hover?(pointer: ScenePointer): boolean;
}

/** What happens where no tool wants the pointer. */
export interface Default {
  click(pointer: ScenePointer): void;
  doubleClick(pointer: ScenePointer): void;
  /** null: the pointer left. */
  hover(pointer: ScenePointer | null): void;
}

const CLICK_PIXELS = 5;

export class Tools {
  #tools: PointerTool[] = [];
  #taken: { tool: PointerTool; id: number } | null = null;
  #pressed: { x: number; y: number; id: number } | null = null;

  constructor(private readonly stage: Stage, private readonly picker: Picker, private readonly otherwise: Default) {
    const { canvas } = stage;
    const on = (type: "pointerdown" | "pointermove" | "pointerup" | "pointercancel" | "pointerleave", run: (event: PointerEvent) => void) =>
      canvas.parentElement!.addEventListener(type, (event) => event.target === canvas && run(event), { capture: true });
    on("pointerdown", (event) => this.#down(event));
    on("pointermove", (event) => this.#move(event));
    on("pointerup", (event) => this.#up(event));
    on("pointercancel", () => this.cancel());
    canvas.addEventListener("pointerleave", () => this.otherwise.hover(null));
    canvas.addEventListener("dblclick", (event) => this.otherwise.doubleClick(this.#pointer(event as PointerEvent)));
  }

  /** The last one added is asked first. Returns the way to take it away. */
  add(tool: PointerTool): () => void {
    this.#tools.unshift(tool);
    return () => {
      if (this.#taken?.tool === tool) this.cancel();
      this.#tools = this.#tools.filter((other) => other !== tool);
    };
  }

  /** True where a tool had the pointer. */
  cancel(): boolean {
    this.#pressed = null;
    const taken = this.#taken;
    if (!taken) return false;
    this.#taken = null;
    taken.tool.cancel();
    return true;
  }

  #pointer(event: PointerEvent): ScenePointer {
    const { canvas, camera } = this.stage;
    const box = canvas.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    const caster = new THREE.Raycaster();
    camera.updateMatrixWorld();
    caster.setFromCamera(new THREE.Vector2((x / box.width) * 2 - 1, 1 - (y / box.height) * 2), camera);
    return { x, y, ray: caster.ray, event, pick: () => this.picker.pick(x, y) };
  }

  #down(event: PointerEvent): void {
    if (this.#taken) return event.stopPropagation();
    this.#pressed = { x: event.clientX, y: event.clientY, id: event.pointerId };
    if (event.button !== 0 || event.shiftKey || event.ctrlKey) return;
    const pointer = this.#pointer(event);
    const tool = this.#tools.find((each) => each.down(pointer));
    if (!tool) return;
    this.#taken = { tool, id: event.pointerId };
    this.#pressed = null;
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.stage.canvas.focus();
    // The camera's controls listen on the canvas itself, further down.
    event.stopPropagation();
  }

  #move(event: PointerEvent): void {
    if (this.#taken) {
      event.stopPropagation();
      if (event.pointerId === this.#taken.id) this.#taken.tool.move(this.#pointer(event));
      return;
    }
    if (event.buttons !== 0 || event.pointerType === "touch") return;
    const pointer = this.#pointer(event);
    const own = this.#tools.some((tool) => tool.hover?.(pointer));
    this.otherwise.hover(own ? null : pointer);
  }

  #up(event: PointerEvent): void {
    if (this.#taken) {
      event.stopPropagation();
      if (event.pointerId !== this.#taken.id) return;
      const { tool } = this.#taken;
      this.#taken = null;
      tool.up(this.#pointer(event));
      return;
    }
    const pressed = this.#pressed;
    this.#pressed = null;
    if (!pressed || pressed.id !== event.pointerId || event.button !== 0) return;
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > CLICK_PIXELS) return;
    this.otherwise.click(this.#pointer(event));
  }
}
