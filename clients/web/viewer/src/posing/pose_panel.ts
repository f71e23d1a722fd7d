// SPDX-License-Identifier: Apache-2.0
// The panel "Pose": who poses, the pulling tool, all joints by part of the body, and the chosen one.
import type { App } from "../app.js";
import { h, icon, setText } from "../panels/dom.js";
import { treeKeys } from "../panels/tree_keys.js";
import { labelOf } from "../state/names.js";
import { restAngles, settable } from "./angles.js";
import type { BodyDrag } from "./body_drag.js";
import { addJointEditor, MIRROR, PIN } from "./joint_editor.js";
import type { PoseTool } from "./pose_tool.js";
import type { Poser } from "./poser.js";
import type { Rig } from "./rig.js";
import { DEGREES } from "./rotation.js";
import { bodyParts, degreesText, jointLabel } from "./words.js";
import { Store } from "../state/store.js";

export interface PoseOptions {
  /** A pull anywhere on the body moves it. */
  readonly pulls: boolean;
  /** Dots and rings are drawn. */
  readonly joints: boolean;
}

export const PULL = "M8 12V5.5a1.5 1.5 0 0 1 3 0V11m0-6.5a1.5 1.5 0 0 1 3 0V11m0-5a1.5 1.5 0 0 1 3 0v7.5A6.5 6.5 0 0 1 10.5 20C8 20 6.5 18.5 5 16l-1.7-3.2a1.4 1.4 0 0 1 2.4-1.5L8 14";

export function addPosePanel(app: App, poser: Poser, drag: BodyDrag, options: Store<PoseOptions>, tool: PoseTool, strip: HTMLElement): void {
  options.watch((state) => state.pulls, (on) => { tool.pullsBody = on; }, true);
  app.panels.add({
    id: "pose", title: "Pose", icon: "pose", side: "right", order: 0,
    mount: (content) => mount(app, poser, drag, options, strip, content),
  });
}

function mount(app: App, poser: Poser, drag: BodyDrag, options: Store<PoseOptions>, strip: HTMLElement, content: HTMLElement): void {
  const toggle = (glyph: string, label: string, title: string, key: keyof PoseOptions) => {
    const button = h("button", { type: "button", class: "text-button", title, on: { click: () => options.set({ [key]: !options.state[key] }) } }, icon(glyph), label);
    options.watch((state) => state[key], (on) => button.setAttribute("aria-pressed", String(on)), true);
    return button;
  };
  const action = (glyph: string, label: string, title: string, run: () => void) =>
    h("button", { type: "button", class: "text-button", title, on: { click: run } }, icon(glyph), label);
  const pull = toggle(PULL, "Pull the body", "A pull anywhere on the body moves it; else it turns the view (G)", "pulls");
  const mirror = action(MIRROR, "Mirror", "Left and right exchanged (M)", () => poser.mirror());
  const reset = action("undo", "All as scanned", "Every joint as it was scanned (Shift+R)", () => poser.resetAll());
  const tree = h("ul", { class: "tree joints", role: "tree", aria: { label: "Joints" } });
  const pins = h("ul", { class: "pins", aria: { label: "Pinned" } });
  const follow = h("input", { type: "checkbox", id: "move-root", on: { change: () => drag.setMoveRoot(follow.checked) } });
  const whole = h("label", { class: "check", htmlFor: "move-root", title: "Where parts are pinned the trunk may lean and go, as when one reaches out on one's feet" }, follow, "The whole body follows a pull");
  content.append(strip, h("div", { class: "row-of-buttons" }, pull, toggle("eye", "Joints", "Dots and rings in the picture (J)", "joints"), mirror, reset),
    h("div", { class: "tree-box" }, tree), pins, whole);
  addJointEditor(app, poser, drag, content);
  buildTree(poser, tree);
  const paint = () => {
    const { controls, pins: all, rig } = poser.state;
    for (const button of [pull, mirror, reset]) button.disabled = !controls;
    pins.hidden = all.length === 0;
    pins.replaceChildren(...all.map((pin) => {
      const name = labelOf(rig!.segments[pin.segment]!.name);
      return h("li", {}, icon(PIN), name, h("button", {
        type: "button", class: "icon-button small", aria: { label: `Pin ${name.toLowerCase()} no more` },
        on: { click: () => poser.togglePin(pin.segment) },
      }, icon("close")));
    }));
  };
  poser.store.watch((state) => state.pins, (now, before) => {
    // Who pins the feet wants the trunk to lean; it can be switched off.
    if (now.length > 0 && before.length === 0) drag.setMoveRoot(true);
    if (now.length === 0) drag.setMoveRoot(false);
    paint();
  });
  poser.store.watch((state) => state.controls, paint, true);
  drag.store.watch((state) => state.moveRoot, (on) => { follow.checked = on; }, true);
}

function buildTree(poser: Poser, tree: HTMLElement): void {
  let lines = new Map<number, { item: HTMLLIElement; turned: HTMLElement }>();
  const build = (rig: Rig | null) => {
    lines = new Map();
    tree.replaceChildren(...(rig ? bodyParts(rig) : []).map(({ label, rows }, at) => {
      const items = rows.map((row) => {
        const turned = h("span", { class: "count" });
        const item = h("li", {
          role: "treeitem", tabIndex: -1, data: { joint: String(row) }, aria: { selected: false, level: "2" },
          on: { click: (event) => { event.stopPropagation(); poser.select(row); } },
        }, h("div", { class: "line" }, h("span", { class: "name" }, jointLabel(rig!.segments[row]!.joint)), turned));
        lines.set(row, { item, turned });
        return item;
      });
      const group = h("li", { role: "treeitem", tabIndex: at === 0 ? 0 : -1, aria: { expanded: true, level: "1" } },
        h("div", { class: "line group" }, icon("chevron"), h("span", { class: "name" }, label)), h("ul", { role: "group" }, ...items));
      group.addEventListener("click", () => group.setAttribute("aria-expanded", String(group.getAttribute("aria-expanded") !== "true")));
      return group;
    }));
    paint();
    choose();
  };
  const paint = () => {
    const { rig } = poser.state;
    if (rig) for (const [row, { turned }] of lines) setText(turned, turnedText(poser, rig, row));
  };
  const choose = () => {
    const { joint } = poser.state;
    for (const [row, { item }] of lines) item.setAttribute("aria-selected", String(row === joint));
    const line = joint === null ? undefined : lines.get(joint);
    line?.item.parentElement!.closest("li")?.setAttribute("aria-expanded", "true");
    line?.item.scrollIntoView({ block: "nearest" });
  };
  treeKeys(tree, {
    choose: (item) => item.click(),
    act: (item) => item.click(),
  });
  poser.store.watch((state) => state.rig, build, true);
  poser.store.watch((state) => state.body, paint);
  poser.store.watch((state) => state.joint, choose);
}

/** By how much its angles differ most from the scan; nothing where they do not. */
function turnedText(poser: Poser, rig: Rig, row: number): string {
  const { joint } = rig.segments[row]!;
  if (joint.sequence.length === 0) return "";
  const rest = restAngles(joint);
  const most = Math.max(0, ...settable(joint).map((i) => Math.abs(poser.angle(row, i) - rest[i]!)));
  return most * DEGREES < 0.05 ? "" : degreesText(most, 0);
}
