// SPDX-License-Identifier: Apache-2.0
// The panel of the slices: which volume, window and level, labels over it, and where the planes cross, to type in.
import type { App } from "../app.js";
import { h, icon, setText } from "../panels/dom.js";
import type { Board } from "./board.js";
import { ORIENTATIONS } from "./plane.js";
import type { Slices } from "./slices.js";
import type { SliceState, SliceTool } from "./state.js";
import { CT_PRESETS, presetOf } from "./window.js";

export interface ToolChoice {
  readonly id: SliceTool;
  readonly label: string;
  readonly icon: string;
}

const TOOLS: readonly ToolChoice[] = [
  { id: "cross", label: "Cross-hair", icon: "M12 3v6M12 15v6M3 12h6M15 12h6" },
  { id: "window", label: "Window", icon: "M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18" },
  { id: "distance", label: "Distance", icon: "m4 15 11-11 5 5L9 20zM8 11l2 2M11 8l3 3M14 5l2 2" },
  { id: "angle", label: "Angle", icon: "M20 19H4L16 5M12 19a8 8 0 0 0-2.6-6" },
];

/** A field of a number that is taken when it is done, and says so where it is none. */
export function numberField(label: string, unit: string, take: (value: number) => void, id: string): { root: HTMLElement; show(value: number): void } {
  const input = h("input", { class: "number", type: "text", inputMode: "decimal", id, autocomplete: "off" });
  let shown = "";
  const apply = () => {
    const value = Number(input.value.replace(",", ".").replace("−", "-"));
    const bad = input.value.trim() === "" || !Number.isFinite(value);
    input.setAttribute("aria-invalid", String(bad));
    if (!bad && input.value !== shown) take(value);
  };
  input.addEventListener("change", apply);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Escape") input.value = shown;
    if (event.key !== "Enter" && event.key !== "Escape") return;
    apply();
    event.stopPropagation();
  });
  const root = h("label", { class: "field" }, h("span", {}, label), h("span", { class: "number-box" }, input, h("span", { class: "unit" }, unit)));
  return {
    root,
    show(value) {
      shown = String(Math.round(value * 100) / 100);
      if (document.activeElement !== input || input.value !== shown) input.value = shown;
      input.setAttribute("aria-invalid", "false");
    },
  };
}

export function addSlicesPanel(app: App, slices: Slices, board: Board, content: HTMLElement): void {
  const { store } = slices;
  const show = h("button", { type: "button", class: "text-button strong", title: "Slices (X)", on: { click: () => store.set({ open: !store.state.open }) } }, "Show slices");
  const fit = h("button", { type: "button", class: "text-button", on: { click: () => board.fit() } }, icon("fit"), "Fit");
  const goTo = h("button", { type: "button", class: "text-button", on: { click: () => {
    const { selected } = app.store.state;
    if (selected === null) return app.say("Choose a tissue first");
    const middle = app.body.bounds([selected]).getCenter(app.stage.controls.target.clone());
    slices.moveTo([middle.x, middle.y, middle.z]);
  } } }, icon("focus"), "Go to tissue");
  content.append(h("div", { class: "row-of-buttons first" }, show, fit, goTo));

  const none = h("p", { class: "none" }, "This model holds no volume (name one under `volumes` of its case, and prepare it again).");
  const body = h("div", { class: "slices-body" }, toolRow(slices), volumes(slices), windowRow(slices), labelRow(slices), places(slices), checks(slices));
  content.append(none, body);
  const update = () => {
    const { volumes: greys, labels, open } = store.state, any = greys.length > 0 || labels !== null;
    none.hidden = any;
    body.hidden = !any;
    show.disabled = !any;
    show.classList.toggle("strong", !open);
    setText(show, open ? "Close slices" : "Show slices");
    fit.disabled = goTo.disabled = !open;
  };
  for (const select of [(s: SliceState) => s.volumes, (s: SliceState) => s.labels, (s: SliceState) => s.open]) store.watch<unknown>(select, update);
  update();
}

function toolRow({ store }: Slices): HTMLElement {
  const buttons = TOOLS.map(({ id, label, icon: path }) => h("button", {
    type: "button", class: "text-button", data: { tool: id }, on: { click: () => store.set({ tool: id }) },
  }, icon(path), label));
  store.watch((state) => state.tool, (tool) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset["tool"] === tool));
  }, true);
  return h("div", { class: "tool-row", role: "group", aria: { label: "What a click on a slice does" } }, ...buttons);
}

function volumes(slices: Slices): HTMLElement {
  const { store } = slices;
  const select = h("select", { id: "slices-volume", on: { change: () => slices.setVolume(select.value || null) } });
  const row = h("label", { class: "surface" }, h("span", {}, "Volume"), select);
  store.watch((state) => state.volumes, (all) => {
    select.replaceChildren(...all.map(({ name }) => h("option", { value: name }, name)), ...(store.state.labels ? [h("option", { value: "" }, "Labels alone")] : []));
    select.value = store.state.volume ?? "";
  }, true);
  store.watch((state) => state.volume, (volume) => { select.value = volume ?? ""; });
  return row;
}

function windowRow(slices: Slices): HTMLElement {
  const { store } = slices;
  const presets = CT_PRESETS.map((preset) => h("button", {
    type: "button", class: "text-button", title: `Width ${preset.width}, level ${preset.level}`, data: { preset: preset.name }, on: { click: () => slices.setWindow(preset) },
  }, preset.name));
  const group = h("div", { class: "preset-row", role: "group", aria: { label: "Windows of CT" } }, ...presets);
  const width = numberField("Width", "", (value) => slices.setWindow({ ...store.state.window, width: value }), "slices-width");
  const level = numberField("Level", "", (value) => slices.setWindow({ ...store.state.window, level: value }), "slices-level");
  const root = h("section", { class: "block" }, h("h2", {}, "Window"), group, h("div", { class: "field-row two" }, width.root, level.root));
  const update = () => {
    const { window, volume } = store.state;
    root.hidden = volume === null;
    group.hidden = !slices.volume?.hounsfield;
    width.show(window.width);
    level.show(window.level);
    const now = presetOf(window)?.name;
    for (const button of presets) button.setAttribute("aria-pressed", String(button.dataset["preset"] === now));
  };
  store.watch((state) => state.window, update);
  store.watch((state) => state.volume, update, true);
  return root;
}

function labelRow({ store }: Slices): HTMLElement {
  const slider = h("input", { type: "range", min: "0", max: "100", step: "5", id: "slices-overlay" }), output = h("output", {});
  slider.addEventListener("input", () => store.set({ overlay: Number(slider.value) / 100 }));
  const root = h("section", { class: "block" }, h("h2", {}, "Labels"), h("label", { class: "slider" }, h("span", {}, "Opacity"), slider, output));
  const update = () => {
    const { labels, overlay, volume } = store.state;
    root.hidden = labels === null || volume === null;
    slider.value = String(Math.round(overlay * 100));
    setText(output, `${Math.round(overlay * 100)} %`);
  };
  for (const select of [(s: SliceState) => s.overlay, (s: SliceState) => s.labels, (s: SliceState) => s.volume]) store.watch<unknown>(select, update);
  update();
  return root;
}

/** The cross-hair's place, LPS, to read and to type in. */
function places(slices: Slices): HTMLElement {
  const { store } = slices;
  const axes = [["Left", 0], ["Back", 1], ["Head", 2]] as const;
  const fields = axes.map(([label, axis]) => numberField(label, "mm", (value) => {
    slices.moveTo(store.state.cross.map((each, at) => (at === axis ? value : each)) as unknown as readonly [number, number, number]);
    fields[axis]!.show(store.state.cross[axis]);
  }, `slices-${ORIENTATIONS.find(({ normal }) => normal === axis)!.id}`));
  store.watch((state) => state.cross, (cross) => axes.forEach(([, axis]) => fields[axis]!.show(cross[axis])), true);
  return h("section", { class: "block" }, h("h2", {}, "Cross-hair"), h("div", { class: "field-row" }, ...fields.map(({ root }) => root)));
}

function checks({ store }: Slices): HTMLElement {
  const check = (label: string, key: "inBody" | "smooth") => {
    const input = h("input", { type: "checkbox", on: { change: () => store.set({ [key]: input.checked }) } });
    store.watch((state) => state[key], (on) => { input.checked = on; }, true);
    return h("label", { class: "check" }, input, label);
  };
  return h("div", {}, check("Planes in the body, too", "inBody"), check("Smooth between voxels", "smooth"));
}
