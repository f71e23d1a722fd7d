// SPDX-License-Identifier: Apache-2.0
// The viewer's own panels, each from its file.
import type { App } from "../app.js";
import { addBanner } from "./banner.js";
import { addCover } from "./cover.js";
import { addTheme } from "./theme.js";
import { addTip } from "./tip.js";
import { addTissues } from "./tissues.js";
import { addToolsBar } from "./tools_bar.js";
import { addTop } from "./top.js";

export function addPanels(app: App): void {
  addTheme(app);
  addTop(app);
  addToolsBar(app);
  addTissues(app);
  addTip(app);
  addBanner(app);
  addCover(app);
}
