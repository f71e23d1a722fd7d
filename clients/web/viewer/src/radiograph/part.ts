// SPDX-License-Identifier: Apache-2.0
// All of the radiograph, wired.
import type { App } from "../app.js";
import type { Posing } from "../posing/index.js";
import { addRadiographPanel } from "./panel.js";
import { XRay } from "./xray.js";

export function makeRadiograph(app: App, posing: Posing, content: HTMLElement): XRay {
  const xray = new XRay(app, posing);
  addRadiographPanel(app, posing, xray, content);
  // For the browser's console, and for tests.
  Object.assign(window, { ecorcheXray: xray });
  return xray;
}
