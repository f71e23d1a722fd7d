// SPDX-License-Identifier: Apache-2.0
// The list of measures: what they are in the posed body and were in the scan.
import type { App } from "../app.js";
import { h, icon, iconButton, setText } from "../panels/dom.js";
import { pointsOf, spell, table, valuesOf, type Measure } from "./measure.js";
import type { Measures } from "./measures.js";
import type { Slices } from "./slices.js";

const COPY = "M9 9h11v11H9zM15 9V4H4v11h5";

export function addMeasurePanel(app: App, slices: Slices, measures: Measures, content: HTMLElement): void {
  const hint = h("p", { class: "quiet" }), rows = h("tbody", {});
  const list = h("table", { class: "measures" },
    h("thead", {}, h("tr", {}, ...["", "Posed", "Scanned", ""].map((text) => h("th", { scope: "col" }, text)))), rows);
  const copyAll = h("button", { type: "button", class: "text-button", on: { click: () => void copy(app, measures.store.state.list) } }, icon(COPY), "Copy all");
  const removeAll = h("button", { type: "button", class: "text-button", on: { click: () => measures.remove(measures.store.state.list.map(({ id }) => id)) } }, icon("close"), "Remove all");
  const buttons = h("div", { class: "row-of-buttons" }, copyAll, removeAll);
  content.append(h("section", { class: "block" }, h("h2", {}, "Measures"), hint, list, buttons));
  const update = () => {
    const { list: all, draft } = measures.store.state, { tool } = slices.store.state;
    list.hidden = buttons.hidden = all.length === 0;
    const measuring = tool === "distance" || tool === "angle" ? tool : null;
    const left = measuring ? pointsOf(measuring) - (draft?.kind === measuring ? draft.points.length : 0) : 0;
    const words = ["", "one more point", "two more points", "three points"], first = measuring === "distance" && left === 2 ? "two points" : words[left];
    setText(hint, measuring ? `Click ${first} on a slice or on the body${measuring === "angle" && left === 2 ? "; next its corner" : ""}.`
      : all.length === 0 ? "Choose Distance or Angle above, then click." : "");
    hint.hidden = hint.textContent === "";
    rows.replaceChildren(...all.map((measure, row) => line(app, measures, measure, row)));
  };
  measures.store.watch((state) => state.list, update);
  measures.store.watch((state) => state.draft, update);
  slices.store.watch((state) => state.tool, (tool) => {
    if (measures.store.state.draft && measures.store.state.draft.kind !== tool) measures.cancel();
    update();
  }, true);
}

function line(app: App, measures: Measures, measure: Measure, row: number): HTMLElement {
  const { posed, scanned } = valuesOf(measure), { kind, id } = measure;
  const name = `${kind === "distance" ? "Distance" : "Angle"} ${row + 1}`;
  const small = (button: HTMLButtonElement) => (button.classList.add("small"), button);
  return h("tr", { data: { measure: String(id) } }, h("th", { scope: "row" }, name), h("td", {}, spell(kind, posed)),
    h("td", { title: scanned === null ? "A point lies outside of the body: it has no place in the scan" : "" }, scanned === null ? "none" : spell(kind, scanned)),
    h("td", {}, small(iconButton(COPY, `Copy ${name.toLowerCase()}`, () => void copy(app, [measure]))),
      small(iconButton("close", `Remove ${name.toLowerCase()}`, () => measures.remove([id])))));
}

async function copy(app: App, list: readonly Measure[]): Promise<void> {
  try {
    await navigator.clipboard.writeText(table(list));
    app.say(list.length === 1 ? "Copied" : `${list.length} measures copied`);
  } catch {
    app.say("The browser does not let this page copy (open it by https or from this machine)");
  }
}
