// SPDX-License-Identifier: Apache-2.0
// What stands in the way of the picture while there is no body, or when there will be none: what is wrong, and what to do.
import { h } from "./dom.js";
import type { App } from "../app.js";

export interface Cover {
  readonly lead: string;
  readonly text?: string;
  /** As the machine said it. */
  readonly detail?: string;
  readonly working?: boolean;
  /** A button that loads the page again. */
  readonly again?: boolean;
}

export function showCover(cover: Cover | null): void {
  const root = document.querySelector<HTMLElement>("#cover")!;
  root.hidden = cover === null;
  if (!cover) return;
  const { lead, text, detail, working, again } = cover;
  root.replaceChildren(h("div", { class: "card", role: working ? "status" : "alert" },
    h("p", { class: "lead" }, working && h("span", { class: "working" }), lead),
    text && h("p", {}, text),
    detail && h("code", {}, detail),
    again && h("div", { class: "buttons" }, h("button", { type: "button", class: "text-button strong", on: { click: () => location.reload() } }, "Try again")),
  ));
}

/** Until the first body: how far the connection is, or why it fails. */
export function addCover(app: App): void {
  let shown = false;
  const update = () => {
    const { link, model } = app.store.state;
    if (shown) return;
    if (link.state === "closed" && !link.mends) showCover({ lead: "There is no body to show", text: link.reason, again: true });
    else if (link.state === "closed") showCover({ lead: "Waiting for the server", text: link.reason, working: true });
    else showCover({ lead: model ? `Fetching ${model.name}` : "Connecting", working: true });
  };
  app.store.watch((state) => state.link, update, true);
  app.store.watch((state) => state.model?.name, update);
  app.live.onBody((first) => {
    if (!first) return;
    shown = true;
    showCover(null);
  });
}
