// SPDX-License-Identifier: Apache-2.0
// The chosen tissue: its name, how strongly it is shown, and what one does with it.
import type { App } from "../app.js";
import { groupLabel } from "../state/names.js";
import { h, icon, iconButton, setText } from "./dom.js";

export function addChosen(app: App, content: HTMLElement): void {
  const name = h("h2", {}), detail = h("p", {});
  const opacity = h("input", { type: "range", min: "0", max: "100", step: "5", id: "opacity", aria: { label: "Opacity" } });
  const percent = h("output", { htmlFor: "opacity" } as object);
  const rows = () => (app.store.state.selected === null ? [] : [app.store.state.selected]);
  opacity.addEventListener("input", () => app.layers.setOpacity(rows(), Number(opacity.value) / 100));
  const hideIcon = h("span", { class: "contents" }, icon("eye")), hideWord = h("span", {});
  const hide = h("button", { type: "button", class: "text-button", title: "Hide or show (H)", on: { click: () => hideOrShow(app) } }, hideIcon, hideWord);
  const isolate = h("button", { type: "button", class: "text-button", title: "Show it alone (I)", on: { click: () => app.layers.isolate(rows()) } }, icon("isolate"), "Isolate");
  const focus = h("button", { type: "button", class: "text-button", title: "Bring it before the camera (Z)", on: { click: () => app.focusSelected() } }, icon("focus"), "Focus");
  const close = iconButton("close", "Choose nothing", () => app.select(null), "Esc");
  close.classList.add("small");
  const box = h("div", { class: "chosen" }, h("div", { class: "chosen-head" }, h("div", {}, name, detail), close),
    h("label", { class: "slider" }, h("span", {}, "Opacity"), opacity, percent), h("div", { class: "row-of-buttons" }, hide, isolate, focus));
  content.append(box);
  const update = () => {
    const { selected, model, layers, isolated } = app.store.state;
    const tissue = selected === null ? undefined : model?.tissues[selected];
    box.hidden = !tissue;
    if (!tissue) return;
    const layer = layers[tissue.row]!;
    setText(name, tissue.label);
    setText(detail, `${groupLabel(tissue.group)}, ${tissue.vertices.toLocaleString("en")} vertices`);
    opacity.value = String(Math.round(layer.opacity * 100));
    setText(percent, `${opacity.value} %`);
    hideIcon.replaceChildren(icon(layer.visible ? "eyeOff" : "eye"));
    setText(hideWord, layer.visible ? "Hide" : "Show");
    isolate.setAttribute("aria-pressed", String(isolated !== null && isolated.size === 1 && isolated.has(tissue.row)));
  };
  app.store.watch((state) => state.selected, update, true);
  app.store.watch((state) => state.layers, update);
  app.store.watch((state) => state.isolated, update);
  app.store.watch((state) => state.model, update);
}

export function hideOrShow(app: App): void {
  const { selected, layers } = app.store.state;
  if (selected !== null) app.layers.setVisible([selected], !layers[selected]!.visible);
}
