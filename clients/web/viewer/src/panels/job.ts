// SPDX-License-Identifier: Apache-2.0
// Something that takes a while: a line at the foot of the picture with how far it is, and a way to stop it.
import type { App } from "../app.js";
import { h, setText } from "./dom.js";

export interface Job {
  say(text: string): void;
  /** 0 to 1. */
  progress(share: number): void;
  end(): void;
}

export function showJob(app: App, title: string, cancel: () => void): Job {
  const text = h("span", { role: "status" }, title), bar = h("progress", { max: 1, aria: { label: title } });
  const root = h("div", { class: "job float" }, text, bar, h("button", { type: "button", class: "text-button", on: { click: cancel } }, "Cancel"));
  app.places.root.append(root);
  return {
    say: (what) => setText(text, `${title}: ${what.charAt(0).toLowerCase()}${what.slice(1)}`),
    progress: (share) => { bar.value = share; },
    end: () => root.remove(),
  };
}
