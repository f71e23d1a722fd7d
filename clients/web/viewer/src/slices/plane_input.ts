// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and keys on one plane. The left button is the chosen tool's, the right one windows, the middle one (or Shift) moves the
// picture; a wheel steps, with Ctrl it zooms; two fingers zoom and move.
import type { Vec3 } from "../posing/rotation.js";
import type { PlaneView } from "./plane_view.js";

export interface PlaneActions {
  /** `first`: the button went down there just now; `last`: it went up. */
  tool(view: PlaneView, point: Vec3, phase: "down" | "move" | "up"): void;
  window(dx: number, dy: number): void;
  step(view: PlaneView, by: number): void;
  /** By pixels of the lattice, to the right and down. */
  nudge(view: PlaneView, right: number, down: number): void;
  hover(view: PlaneView, point: Vec3 | null): void;
  whole(view: PlaneView): void;
  windows(): boolean;
}

type Drag = "tool" | "window" | "pan";

const WHEEL_STEP = 60;

export function listen(view: PlaneView, actions: PlaneActions): void {
  const { canvas } = view;
  const pointers = new Map<number, { x: number; y: number }>();
  let drag: Drag | null = null, wheel = 0;
  const at = (event: MouseEvent) => {
    const box = canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  };
  const use = (event: PointerEvent, phase: "down" | "move" | "up") => {
    const { x, y } = at(event), point = view.pointAt(x, y);
    if (point) actions.tool(view, point, phase);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    pointers.set(event.pointerId, at(event));
    event.preventDefault();
    if (pointers.size > 1) {
      drag = null;
      return;
    }
    drag = event.button === 1 || event.shiftKey ? "pan" : event.button === 2 || actions.windows() ? "window" : "tool";
    if (drag === "tool") use(event, "down");
  });
  canvas.addEventListener("pointermove", (event) => {
    const now = at(event), before = pointers.get(event.pointerId);
    actions.hover(view, view.pointAt(now.x, now.y));
    if (!before) return;
    pointers.set(event.pointerId, now);
    const dx = now.x - before.x, dy = now.y - before.y;
    if (pointers.size === 2) pinch(view, [...pointers.entries()], event.pointerId, before);
    else if (drag === "pan") view.pan(dx, dy);
    else if (drag === "window") actions.window(dx, dy);
    else if (drag === "tool") use(event, "move");
  });
  const end = (event: PointerEvent) => {
    if (!pointers.delete(event.pointerId)) return;
    if (drag === "tool") use(event, "up");
    if (pointers.size === 0) drag = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => actions.hover(view, null));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => actions.whole(view));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (event.ctrlKey || event.metaKey) {
      const { x, y } = at(event);
      return view.zoom(Math.exp(-event.deltaY / 300), x, y);
    }
    // Fine wheels and trackpads send parts of a step; a notch of a mouse is one.
    const delta = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * WHEEL_STEP;
    wheel += Math.abs(delta) >= WHEEL_STEP ? Math.sign(delta) * WHEEL_STEP : delta;
    const steps = Math.trunc(wheel / WHEEL_STEP);
    wheel -= steps * WHEEL_STEP;
    if (steps !== 0) actions.step(view, -steps);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    if (press(view, actions, event)) event.preventDefault();
  });
}

function press(view: PlaneView, actions: PlaneActions, event: KeyboardEvent): boolean {
  if (event.altKey || event.ctrlKey || event.metaKey) return false;
  const steps: Record<string, number> = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10 };
  const step = steps[event.key];
  if (step !== undefined) {
    if (!event.shiftKey || event.key.startsWith("Page")) actions.step(view, step);
    else if (event.key === "ArrowUp" || event.key === "ArrowDown") actions.nudge(view, 0, -step);
    else actions.nudge(view, step, 0);
    return true;
  }
  if (event.key === "+" || event.key === "=") view.zoomBy(1.25);
  else if (event.key === "-") view.zoomBy(0.8);
  else if (event.key === "0" || event.key === "Home") view.fit();
  else if (event.key === "Enter") actions.whole(view);
  else return false;
  return true;
}

function pinch(view: PlaneView, both: [number, { x: number; y: number }][], moved: number, before: { x: number; y: number }): void {
  const now = both.find(([id]) => id === moved)![1], other = both.find(([id]) => id !== moved)![1];
  const apart = (a: { x: number; y: number }) => Math.max(1, Math.hypot(a.x - other.x, a.y - other.y));
  view.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
  view.zoom(apart(now) / apart(before), (now.x + other.x) / 2, (now.y + other.y) / 2);
}
