// SPDX-License-Identifier: Apache-2.0
// All of the slices, wired.
import type { App } from "../app.js";
import { Board } from "./board.js";
import { ScenePlanes } from "./scene_planes.js";
import { Slices } from "./slices.js";
import { addSlicesPanel } from "./slices_panel.js";

export interface SlicesPart {
  readonly slices: Slices;
  readonly board: Board;
}

export function makeSlices(app: App, content: HTMLElement): SlicesPart {
  const slices = new Slices(app), board = new Board(app, slices);
  new ScenePlanes(app.stage, slices);
  addSlicesPanel(app, slices, board, content);
  const part = { slices, board };
  // For the browser's console, and for tests.
  Object.assign(window, { ecorcheSlices: part });
  return part;
}
