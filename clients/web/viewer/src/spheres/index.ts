// SPDX-License-Identifier: Apache-2.0
// What volumes hang on: the tab of the balls. The part comes when somebody asks for it.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { h } from "../panels/dom.js";
import type { Posing } from "../posing/index.js";

const ICON = "M8 9a4 4 0 1 0 0-.1M15.500 17a3 3 0 1 0 0-.1M17 7a2 2 0 1 0 0-.1M11 11l3 4M11.500 8.500 15 7.500";

export function addBalls(app: App, posing: Posing): void {
  const content = h("div", { class: "panel-content" }, h("p", { class: "none" }, "Loading the balls"));
  let coming: Promise<unknown> | undefined;
  app.panels.add({
    id: "balls", title: "Balls", icon: ICON, side: "right", order: 58,
    mount: (root) => root.append(content),
    shown: (on) => {
      if (!on) return;
      coming ??= import("./part.js").then(({ makeBalls }) => {
        content.replaceChildren();
        makeBalls(app, posing, content);
      }).catch((error: unknown) => {
        coming = undefined;
        app.say(`The balls did not load: ${wordsOf(error)}`);
      });
    },
  });
}
