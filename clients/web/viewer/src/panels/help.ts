// SPDX-License-Identifier: Apache-2.0
// Help: what the pointer and every key do, from the table of keys itself; and the licences of what the viewer stands on.
import type { App } from "../app.js";
import { keyCaps } from "../keys.js";
import { h, iconButton } from "./dom.js";
import { wordsOf } from "../errors.js";

export function openHelp(app: App): void {
  const groups = new Map<string, HTMLElement>();
  for (const { group, keys, label } of app.keys.bindings) {
    if (!groups.has(group)) groups.set(group, h("dl", { class: "keys" }));
    const caps = keys.flatMap((each, at) => [at > 0 ? " or " : "", ...keyCaps(each).map((cap) => h("kbd", {}, cap))]);
    groups.get(group)!.append(h("div", {}, h("dt", {}, label), h("dd", {}, ...caps)));
  }
  const pointer = [
    ["Turn the view", "Drag"], ["Move the view", "Right drag, or two fingers"], ["Nearer and farther", "Wheel, or pinch"],
    ["Choose a tissue", "Click"], ["Bring a tissue before the camera", "Double click"],
  ].map(([what, how]) => h("div", {}, h("dt", {}, what!), h("dd", {}, how!)));
  openDialog("Help", [
    h("p", {}, "A body in the pose that the server computes, as it was scanned and deformed. For training and education, not for planning surgery."),
    h("h3", {}, "Pointer"), h("dl", { class: "keys" }, ...pointer),
    ...[...groups].flatMap(([name, list]) => [h("h3", {}, name), list]),
    ...app.helpParts.flatMap((part) => {
      const { title, lines } = part();
      return [h("h3", {}, title), ...lines.map((line) => h("p", {}, line))];
    }),
    h("h3", {}, "About"),
    h("p", {}, "ecorche, Apache-2.0. ", h("button", { type: "button", class: "text-button", on: { click: () => void openLicences() } }, "Licences")),
  ]);
}

/** The texts that the build took from the packages that it bundled. */
async function openLicences(): Promise<void> {
  const list = h("div", {}, h("p", {}, "Fetching the licences"));
  openDialog("Licences", [list]);
  try {
    const answer = await fetch("licences.txt");
    if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
    const parts = (await answer.text()).split(/\n-{40,}\n/);
    list.replaceChildren(h("p", {}, "The viewer is under Apache-2.0 and stands on these packages:"), ...parts.map((part) => {
      const [head, ...text] = part.trim().split("\n");
      return h("details", { class: "licence" }, h("summary", {}, head!), h("pre", {}, text.join("\n").trim()));
    }));
  } catch (error) {
    list.replaceChildren(h("p", {}, `The licences did not come: ${wordsOf(error)}. Is the server still running?`));
  }
}

/** One dialog at a time, with its heading and a way to close it; the focus goes back to where it was. */
export function openDialog(title: string, content: (Node | string)[]): HTMLDialogElement {
  document.querySelector<HTMLDialogElement>("dialog[open]")?.close();
  const dialog = h("dialog", { aria: { labelledby: "dialog-title" } });
  const close = iconButton("close", "Close", () => dialog.close(), "Esc");
  dialog.append(h("header", {}, h("h2", { id: "dialog-title" }, title), close), h("div", { class: "scroll", tabIndex: 0 }, ...content));
  dialog.addEventListener("close", () => dialog.remove());
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
  document.querySelector("#viewer")!.append(dialog);
  dialog.showModal();
  close.focus();
  return dialog;
}
