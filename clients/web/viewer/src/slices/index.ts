// SPDX-License-Identifier: Apache-2.0
// Slices, measures and the clipping plane: their tab and their keys. The part itself comes when somebody asks for it.
import type { App } from "../app.js";
import { h } from "../panels/dom.js";
import type { SlicesPart } from "./part.js";
import { wordsOf } from "../errors.js";

const ICON = "M4 4h7v7H4zM13 4h7v7h-7zM4 13h7v7H4zM16.5 13v7M13 16.5h7";

export function addSlices(app: App): void {
  const content = h("div", { class: "panel-content" }, h("p", { class: "none" }, "Loading the slices"));
  let coming: Promise<SlicesPart> | undefined;
  const part = (): Promise<SlicesPart> => coming ??= import("./part.js").then(({ makeSlices }) => {
    content.replaceChildren();
    return makeSlices(app, content);
  });
  const use = (run: (part: SlicesPart) => void) => void part().then(run, (error: unknown) => {
    coming = undefined;
    app.say(`The slices did not load: ${wordsOf(error)}`);
  });
  let opened = false;
  app.panels.add({
    id: "slices", title: "Slices", icon: ICON, side: "right", order: 50,
    mount: (root) => root.append(content),
    shown: (on) => {
      if (!on || opened) return;
      opened = true;
      use(({ slices }) => slices.store.set({ open: true }));
    },
  });
  const group = "Slices and measures";
  const open = (run: (part: SlicesPart) => void) => () => {
    opened = true;
    app.panels.open("slices");
    use(run);
  };
  app.keys.add(
    { keys: ["l"], label: "Measure a distance", group, run: open(({ slices }) => slices.store.set({ tool: "distance" })) },
    { keys: ["Shift+l"], label: "Measure an angle", group, run: open(({ slices }) => slices.store.set({ tool: "angle" })) },
    { keys: ["c"], label: "Cut the body open, or close it", group, run: open(({ clipping }) => clipping.toggle()) },
    { keys: ["x"], label: "Slices beside the body, or none", group, run: open(({ slices }) => slices.store.set({ open: !slices.store.state.open })) },
  );
}
