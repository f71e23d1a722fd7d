// SPDX-License-Identifier: Apache-2.0
// The panel of the balls: which volume's, what is shown, what a click picks, what they are hung on, and where it goes.
import type { App } from "../app.js";
import { h, setText } from "../panels/dom.js";
import type { Store } from "../state/store.js";
import { numberField } from "../slices/slices_panel.js";
import type { BallPick } from "./ball_tool.js";
import { colorOf, type Parts } from "./ball_scene.js";
import type { Hanging, HangingState } from "./hanging.js";

export interface BallsState extends Parts {
  readonly tool: BallPick;
  /** Row of the segment that is chosen to hang balls on, and whose joint is. */
  readonly target: number;
}

export interface BallsActions {
  load(): void;
  reset(): void;
  save(): void;
  saveVolume(): void;
  /** In the scan. */
  placeJoint(row: number, place: readonly [number, number, number]): void;
}

const TOOLS: readonly { id: BallPick; label: string }[] = [
  { id: "single", label: "One ball" }, { id: "box", label: "Box" }, { id: "brush", label: "Brush" }, { id: "joint", label: "Joint" },
];

export function addBallsPanel(app: App, hanging: Hanging, store: Store<BallsState>, names: () => readonly string[], actions: BallsActions, content: HTMLElement): void {
  const button = (label: string, run: () => void, strong = false) => h("button", { type: "button", class: strong ? "text-button strong" : "text-button", on: { click: run } }, label);
  const load = button("Show the balls", actions.load, true), counts = h("p", { class: "none", role: "status" });
  const tools = TOOLS.map(({ id, label }) => h("button", { type: "button", class: "text-button", data: { pick: id }, on: { click: () => store.set({ tool: store.state.tool === id ? "off" : id }) } }, label));
  const segment = h("select", { id: "balls-segment", on: { change: () => store.set({ target: Number(segment.value) }) } });
  const swatch = h("span", { class: "swatch" });
  const hang = button("Hang on it", () => hanging.assign(store.state.target, names()[store.state.target] ?? ""));
  const whole = button("Pick all of it", () => {
    const rows = Array.from(hanging.store.state.segment.keys()).filter((row) => hanging.store.state.segment[row] === store.state.target);
    hanging.pick(rows, "replace");
  });
  const none = button("Pick none", () => hanging.pick([], "replace"));
  const axes = (["Left", "Back", "Head"] as const).map((label, axis) => numberField(label, "mm", (value) => {
    const { joints } = hanging.store.state, at = 3 * store.state.target;
    const place = [joints[at]!, joints[at + 1]!, joints[at + 2]!] as [number, number, number];
    place[axis] = value;
    actions.placeJoint(store.state.target, place);
  }, `balls-joint-${axis}`));
  const reset = button("As the model has it", actions.reset), save = button("Save as .vtp", actions.save), volume = button("Save the volume by these balls", actions.saveVolume);
  const check = (label: string, key: keyof Parts) => {
    const input = h("input", { type: "checkbox", on: { change: () => store.set({ [key]: input.checked }) } });
    store.watch((state) => state[key], (on) => { input.checked = on; }, true);
    return h("label", { class: "check" }, input, label);
  };
  const body = h("div", {},
    h("div", {}, check("Balls", "balls"), check("Tree", "tree"), check("Joints", "joints")),
    h("section", { class: "block" }, h("h2", {}, "Pick"), h("div", { class: "tool-row", role: "group", aria: { label: "What the pointer picks" } }, ...tools), counts, h("div", { class: "row-of-buttons" }, whole, none)),
    h("section", { class: "block" }, h("h2", {}, "Segment"), h("label", { class: "surface" }, h("span", {}, swatch, " Segment"), segment), h("div", { class: "row-of-buttons" }, hang),
      h("h2", {}, "Its joint, in the scan"), h("div", { class: "field-row" }, ...axes.map(({ root }) => root))),
    h("section", { class: "block" }, h("div", { class: "row-of-buttons" }, reset, save, volume)));
  content.append(h("p", { class: "hint-text" }, "A volume can follow the body by balls that hang on its segments. Pick balls, hang them on another segment, or move joints: posed volumes of this session go by it."),
    h("div", { class: "row-of-buttons first" }, load), body);

  const update = () => {
    const { spheres, picked, joints } = hanging.store.state, { tool, target } = store.state, controls = app.store.state.model?.controls ?? false;
    body.hidden = spheres === null;
    setText(load, spheres ? "Hide the balls" : "Show the balls");
    load.classList.toggle("strong", spheres === null);
    for (const each of tools) each.setAttribute("aria-pressed", String(each.dataset["pick"] === tool));
    setText(counts, `${picked.size} of ${spheres?.distance.length ?? 0} balls picked`);
    hang.disabled = reset.disabled = !controls;
    for (const { root } of axes) root.querySelector("input")!.disabled = !controls;
    hang.title = controls ? "" : "Only who controls the session may";
    axes.forEach((field, axis) => field.show(joints[3 * target + axis] ?? 0));
    const color = `#${colorOf(target).getHexString()}`;
    swatch.style.setProperty("background-color", color);
  };
  hanging.store.watch((state: HangingState) => state.spheres, () => {
    segment.replaceChildren(...names().map((name, row) => h("option", { value: String(row) }, name)));
    segment.value = String(store.state.target);
  });
  hanging.store.watch((state) => state, update, true);
  store.watch((state) => state, update);
  app.store.watch((state) => state.model?.controls, update);
}
