// SPDX-License-Identifier: Apache-2.0
// The posed volume itself in the picture: its tab and its key. The part comes when somebody asks for it.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { h } from "../panels/dom.js";
import type { VolumePart } from "./part.js";

const ICON = "M12 2.5 20.5 7v10L12 21.5 3.5 17V7zM3.5 7 12 11.5 20.5 7M12 11.5v10";

export function addVolume(app: App): void {
  const content = h("div", { class: "panel-content" }, h("p", { class: "none" }, "Loading the volume's part"));
  let coming: Promise<VolumePart> | undefined;
  const part = () => coming ??= import("./part.js").then(({ makeVolume }) => {
    content.replaceChildren();
    return makeVolume(app, content);
  });
  const use = (run: (part: VolumePart) => void) => void part().then(run, (error: unknown) => {
    coming = undefined;
    app.say(`The volume's part did not load: ${wordsOf(error)}`);
  });
  app.panels.add({
    id: "volume", title: "Volume", icon: ICON, side: "right", order: 55,
    mount: (root) => root.append(content),
    shown: (on) => on && use(() => {}),
  });
  app.keys.add({
    keys: ["v"], label: "The posed volume, or none", group: "Volume",
    run: () => {
      app.panels.open("volume");
      use(({ view }) => view.toggle());
    },
  });
}
