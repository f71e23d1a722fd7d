// SPDX-License-Identifier: Apache-2.0
// The clipping plane's fields: all that its handle does, and more.
import { DEGREES } from "../posing/rotation.js";
import { h, setText } from "../panels/dom.js";
import { placeOf, withPlace, type Clip } from "./clip.js";
import type { Clipping } from "./clipping.js";
import { ORIENTATIONS, type PlaneId } from "./plane.js";
import { numberField } from "./slices_panel.js";

export function addClipPanel(clipping: Clipping, content: HTMLElement): void {
  const { store } = clipping, set = (patch: Partial<Clip>) => store.set({ clip: { ...store.state.clip, ...patch } });
  const button = (label: string, run: () => void) => h("button", { type: "button", class: "text-button", on: { click: run } }, label);
  const onOff = button("Cut the body open", () => clipping.toggle());
  const flip = button("Flip", () => set({ flipped: !store.state.clip.flipped })), middle = button("To the cross-hair", () => clipping.toCross());
  const axes = h("select", { id: "clip-plane", on: { change: () => set({ plane: axes.value as PlaneId, tilt: 0, turn: 0 }) } },
    ...ORIENTATIONS.map(({ id, title }) => h("option", { value: id }, title)));
  const place = numberField("Place", "mm", (value) => store.set({ clip: withPlace(store.state.clip, value) }), "clip-place");
  const tilt = numberField("Tilt", "°", (value) => set({ tilt: Math.min(90, Math.max(-90, value)) / DEGREES }), "clip-tilt");
  const turn = numberField("Turn", "°", (value) => set({ turn: value / DEGREES }), "clip-turn");
  const fields = h("div", {}, h("label", { class: "surface plain" }, h("span", {}, "Plane"), axes),
    h("div", { class: "field-row" }, place.root, tilt.root, turn.root), h("div", { class: "row-of-buttons" }, flip, middle));
  content.append(h("section", { class: "block" }, h("h2", {}, "Clipping plane"), h("div", { class: "row-of-buttons" }, onOff), fields));
  store.watch((state) => state.clip, (clip) => {
    fields.hidden = !clip.on;
    onOff.setAttribute("aria-pressed", String(clip.on));
    setText(onOff, clip.on ? "Close the body" : "Cut the body open");
    flip.setAttribute("aria-pressed", String(clip.flipped));
    axes.value = clip.plane;
    place.show(placeOf(clip));
    tilt.show(clip.tilt * DEGREES);
    turn.show(clip.turn * DEGREES);
  }, true);
}
