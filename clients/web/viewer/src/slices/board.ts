// SPDX-License-Identifier: Apache-2.0
// The three planes beside the body, in a square of four: axial, the body itself, coronal and sagittal; or one of them alone. Narrow pages
// show one at a time.
import type { App } from "../app.js";
import type { Vec3 } from "../posing/rotation.js";
import { h } from "../panels/dom.js";
import { ORIENTATIONS, type PlaneId } from "./plane.js";
import { listen } from "./plane_input.js";
import { PlaneView, type Draw } from "./plane_view.js";
import { axisOf, type Slices } from "./slices.js";
import type { SliceState } from "./state.js";
import { presetOf } from "./window.js";

/** Takes clicks in place of the cross-hair, in mm of the patient. True: it used this one. */
export type PlaneTool = (point: Vec3, phase: "down" | "move" | "up", view: PlaneView) => boolean;

export class Board {
  readonly root = h("div", { class: "board", hidden: true });
  readonly views: ReadonlyMap<PlaneId, PlaneView>;
  tool: PlaneTool = () => false;
  readonly #tabs = h("div", { class: "plane-tabs float", role: "group", aria: { label: "Plane" } });

  constructor(private readonly app: App, private readonly slices: Slices) {
    const { store } = slices;
    const actions = {
      tool: (view: PlaneView, point: Vec3, phase: "down" | "move" | "up") => {
        const here = this.#onPlane(view.id, point);
        if (!this.tool(here, phase, view) && phase !== "up") slices.moveTo(here);
      },
      window: (dx: number, dy: number) => {
        const { level, width } = store.state.window, gain = Math.max(0.5, width / 250);
        slices.setWindow({ level: level - dy * gain, width: width + dx * gain });
      },
      step: (view: PlaneView, by: number) => slices.step(axisOf(view.id), by),
      nudge: (view: PlaneView, right: number, down: number) => {
        const { orientation: each } = view;
        if (right !== 0) slices.step(each.right, right * each.rightSign);
        if (down !== 0) slices.step(each.down, down * each.downSign);
      },
      hover: (view: PlaneView, point: Vec3 | null) => store.set({ cursor: point && { plane: view.id, point, ...slices.read(view.id, point) } }),
      whole: (view: PlaneView) => this.toggleWhole(view.id),
      windows: () => store.state.tool === "window",
    };
    this.views = new Map(ORIENTATIONS.map(({ id }) => [id, new PlaneView(id, () => this.toggleWhole(id))]));
    for (const view of this.views.values()) {
      listen(view, actions);
      this.root.append(view.root);
    }
    for (const { id, title } of ORIENTATIONS) {
      this.#tabs.append(h("button", { type: "button", class: "text-button", data: { plane: id }, on: { click: () => store.set({ whole: id }) } }, title));
    }
    this.root.append(this.#tabs);
    app.places.root.querySelector("#picture")!.after(this.root);
    slices.onPainted((id, { plane, canvas }) => {
      this.views.get(id)!.show(plane, canvas);
      this.#say();
    });
    store.watch((state) => state.cross, (cross) => this.views.forEach((view) => { view.cross = cross; }), true);
    store.watch((state) => state.smooth, (smooth) => this.views.forEach((view) => {
      view.smooth = smooth;
      view.invalidate();
    }), true);
    for (const select of [(s: SliceState) => s.cursor, (s: SliceState) => s.window, (s: SliceState) => s.volume]) store.watch<unknown>(select, () => this.#say());
    store.watch((state) => state.open, () => this.#arrange());
    store.watch((state) => state.whole, () => this.#arrange());
    store.watch((state) => state.tool, (tool) => { this.root.dataset["tool"] = tool; }, true);
    app.stage.onResize(() => this.#place());
  }

  /** What else is drawn over every plane. */
  set draws(draws: readonly Draw[]) {
    for (const view of this.views.values()) view.draws = draws;
    this.invalidate();
  }

  invalidate(): void {
    for (const view of this.views.values()) view.invalidate();
  }

  fit(): void {
    for (const view of this.views.values()) view.fit();
  }

  toggleWhole(id: PlaneId): void {
    if (this.app.panels.narrow) return;
    const { whole } = this.slices.store.state;
    this.slices.store.set({ whole: whole === id ? null : id });
  }

  /** A point of the plane that is drawn, which may be a step behind the cross-hair, in the plane that one sees. */
  #onPlane(id: PlaneId, point: Vec3): Vec3 {
    const axis = axisOf(id), { cross } = this.slices.store.state;
    return point.map((value, each) => (each === axis ? cross[each]! : value)) as unknown as Vec3;
  }

  #arrange(): void {
    const { open, whole } = this.slices.store.state, { narrow } = this.app.panels;
    const shown = whole ?? (narrow ? "axial" : null);
    this.root.hidden = !open;
    this.root.dataset["whole"] = shown ?? "";
    this.#tabs.hidden = !narrow;
    for (const button of this.#tabs.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset["plane"] === shown));
    for (const [id, view] of this.views) {
      view.root.hidden = shown !== null && shown !== id;
      view.isWhole = shown === id;
    }
    this.#place();
  }

  /** Over what panels leave of the picture; the body keeps a quarter, to the upper right. */
  #place(): void {
    const { open, whole } = this.slices.store.state, { stage, panels } = this.app;
    const free = stage.free;
    Object.assign(this.root.style, { left: `${free.left}px`, top: `${free.top}px`, width: `${free.width}px`, height: `${free.height}px` });
    const quarter = open && whole === null && !panels.narrow;
    stage.cover(quarter ? { left: free.width / 2, right: 0, top: 0, bottom: free.height / 2 } : null);
  }

  #say(): void {
    const { window, cursor, volume } = this.slices.store.state, unit = this.slices.volume?.hounsfield ? " HU" : "";
    const preset = presetOf(window);
    const note = volume ? `W ${window.width}  L ${window.level}${this.slices.volume?.hounsfield && preset ? `  ${preset.name}` : ""}` : "";
    for (const [id, view] of this.views) {
      const here = cursor?.plane === id ? cursor : null;
      const value = here?.value === null || !here ? "" : `${Number.isInteger(here.value) ? here.value : here.value.toFixed(2)}${unit}`;
      view.say(note, [value, here?.tissue ?? ""].filter(Boolean).join("  "));
    }
  }
}

