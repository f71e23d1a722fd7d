// SPDX-License-Identifier: Apache-2.0
// The panel of the volume: whether and which is shown, by what colours, and its window.
import { h, setText } from "../panels/dom.js";
import { numberField } from "../slices/slices_panel.js";
import { TRANSFER_PRESETS } from "./transfer.js";
import type { VolumeState, VolumeView } from "./volume_view.js";

export function addVolumePanel(view: VolumeView, content: HTMLElement): void {
  const { store } = view;
  const onOff = h("button", { type: "button", class: "text-button strong", title: "Volume (V)", on: { click: () => view.toggle() } }, "Show the volume");
  const none = h("p", { class: "none" }, "This model holds no volume that could be shown (name one under `volumes` of its case, and prepare it again).");
  const select = h("select", { id: "volume-name", on: { change: () => view.choose(select.value) } });
  const state = h("p", { class: "none", role: "status" });
  const body = h("div", {}, h("label", { class: "surface" }, h("span", {}, "Volume"), select), state, looks(view), checks(view));
  content.append(h("div", { class: "row-of-buttons first" }, onOff), none, body);
  const update = () => {
    const { on, volumes, factor } = store.state;
    none.hidden = volumes.length > 0;
    body.hidden = onOff.disabled = volumes.length === 0;
    onOff.classList.toggle("strong", !on);
    setText(onOff, on ? "Hide the volume" : "Show the volume");
    setText(state, !on ? "" : factor === null ? "Posing on the server" : factor === 1 ? "" : `Too large for the graphics card: ${factor} x ${factor} x ${factor} voxels are shown as one`);
    state.hidden = state.textContent === "";
  };
  store.watch((s) => s.volumes, (volumes) => {
    select.replaceChildren(...volumes.map(({ name }) => h("option", { value: name }, name)));
    select.value = store.state.volume ?? "";
  }, true);
  store.watch((s) => s.volume, (volume) => { select.value = volume ?? ""; });
  for (const part of [(s: VolumeState) => s.on, (s: VolumeState) => s.volumes, (s: VolumeState) => s.factor]) store.watch<unknown>(part, update);
  update();
}

function looks(view: VolumeView): HTMLElement {
  const { store } = view;
  const presets = TRANSFER_PRESETS.map((preset) => h("button", {
    type: "button", class: "text-button", title: `Width ${preset.width}, level ${preset.level}`, data: { transfer: preset.name }, on: { click: () => view.setPreset(preset) },
  }, preset.name));
  const group = h("div", { class: "preset-row", role: "group", aria: { label: "Colours of CT" } }, ...presets);
  const level = numberField("Level", "", (value) => view.setWindow(value, store.state.width), "volume-level");
  const width = numberField("Width", "", (value) => view.setWindow(store.state.level, value), "volume-width");
  const slider = h("input", { type: "range", min: "-2", max: "2", step: "0.25", id: "volume-density" }), output = h("output", {});
  slider.addEventListener("input", () => store.set({ density: 2 ** Number(slider.value) }));
  const update = () => {
    const { preset, level: at, width: wide, density } = store.state;
    group.hidden = !view.volume?.hounsfield;
    for (const button of presets) button.setAttribute("aria-pressed", String(button.dataset["transfer"] === preset.name));
    level.show(at);
    width.show(wide);
    slider.value = String(Math.log2(density));
    setText(output, `${Math.round(100 * density)} %`);
  };
  for (const part of [(s: VolumeState) => s.preset, (s: VolumeState) => s.level, (s: VolumeState) => s.width, (s: VolumeState) => s.density, (s: VolumeState) => s.volume]) store.watch<unknown>(part, update);
  update();
  return h("section", { class: "block" }, h("h2", {}, "Colours"), group, h("div", { class: "field-row two" }, width.root, level.root),
    h("label", { class: "slider" }, h("span", {}, "Density"), slider, output));
}

function checks({ store }: VolumeView): HTMLElement {
  const check = (label: string, key: "surfaces" | "shaded") => {
    const input = h("input", { type: "checkbox", on: { change: () => store.set({ [key]: input.checked }) } });
    store.watch((state) => state[key], (on) => { input.checked = on; }, true);
    return h("label", { class: "check" }, input, label);
  };
  return h("div", {}, check("Surfaces of the body, too", "surfaces"), check("Shade by the slope of the numbers", "shaded"));
}
