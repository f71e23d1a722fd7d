// SPDX-License-Identifier: Apache-2.0
// Where the page begins.
import { App } from "./app.js";
import { showCover } from "./panels/cover.js";
import { addPanels } from "./panels/index.js";
import { addPosing } from "./posing/index.js";
import { addRadiograph } from "./radiograph/index.js";
import { addSlices } from "./slices/index.js";
import { addBalls } from "./spheres/index.js";
import { addVolume } from "./volume/index.js";
import { addHeadset } from "./xr/index.js";
import { wordsOf } from "./errors.js";

/** Parts that hook into the viewer by what App makes public. */
const PARTS: readonly ((app: App) => void)[] = [addPanels];

try {
  const root = document.querySelector<HTMLElement>("#viewer")!;
  const app = new App({ root, canvas: root.querySelector("canvas")! });
  for (const add of PARTS) add(app);
  const posing = addPosing(app);
  // After posing, whose tab is open at first.
  addSlices(app);
  addRadiograph(app, posing);
  addVolume(app);
  addBalls(app, posing);
  const headset = addHeadset(app, posing);
  // For the browser's console, and for tests.
  Object.assign(window, { ecorche: Object.assign(app, { posing, headset }) });
  void app.live.start();
} catch (error) {
  showCover({
    lead: "This browser cannot draw the body",
    text: "The viewer needs WebGL 2. Switch on hardware acceleration in the browser's settings, or open this page in a newer browser.",
    detail: wordsOf(error),
  });
  console.warn(error);
}
