// SPDX-License-Identifier: Apache-2.0
// The radiograph: its tab and its key. The part itself comes when somebody asks for it.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { h } from "../panels/dom.js";
import type { Posing } from "../posing/index.js";
import type { XRay } from "./xray.js";

const ICON = "M12 3v18M12 7c-3-2-6-1-7 2M12 7c3-2 6-1 7 2M12 11.5c-3-2-6-1-7 2M12 11.5c3-2 6-1 7 2M12 16c-2.5-1.6-5-1-6 1.5M12 16c2.5-1.6 5-1 6 1.5";

export function addRadiograph(app: App, posing: Posing): void {
  const content = h("div", { class: "panel-content" }, h("p", { class: "none" }, "Loading the radiograph"));
  let coming: Promise<XRay> | undefined, on = false;
  const part = (): Promise<XRay> => coming ??= import("./part.js").then(({ makeRadiograph }) => {
    content.replaceChildren();
    return makeRadiograph(app, posing, content);
  });
  app.panels.add({
    id: "radiograph", title: "X-ray", icon: ICON, side: "right", order: 55,
    mount: (root) => root.append(content),
    shown: (shown) => {
      on = shown;
      if (!shown && !coming) return;
      void part().then((xray) => xray.show(on), (error: unknown) => {
        coming = undefined;
        app.say(`The radiograph did not load: ${wordsOf(error)}`);
      });
    },
  });
  app.keys.add({ keys: ["Shift+r"], label: "Radiograph", group: "Slices and measures", run: () => app.panels.toggle("radiograph") });
}
