// SPDX-License-Identifier: Apache-2.0
// All of the slices, wired.
import type { App } from "../app.js";
import { Board } from "./board.js";
import { addClipPanel } from "./clip_panel.js";
import { Clipping } from "./clipping.js";
import { drawOnPlane, MeasureScene } from "./measure_draw.js";
import { addMeasurePanel } from "./measure_panel.js";
import { BodyMeasureTool, planeMeasureTool } from "./measure_tool.js";
import { Measures } from "./measures.js";
import type { PlaneId } from "./plane.js";
import { ScenePlanes } from "./scene_planes.js";
import { axisOf, Slices } from "./slices.js";
import { addSlicesPanel } from "./slices_panel.js";

export interface SlicesPart {
  readonly slices: Slices;
  readonly board: Board;
  readonly measures: Measures;
  readonly clipping: Clipping;
}

export function makeSlices(app: App, content: HTMLElement): SlicesPart {
  const slices = new Slices(app), board = new Board(app, slices);
  new ScenePlanes(app.stage, slices);
  const measures = addMeasures(app, slices, board), clipping = new Clipping(app, slices);
  addSlicesPanel(app, slices, board, content);
  addMeasurePanel(app, slices, measures, content);
  addClipPanel(clipping, content);
  const part = { slices, board, measures, clipping };
  // For the browser's console, and for tests.
  Object.assign(window, { ecorcheSlices: part });
  return part;
}

function addMeasures(app: App, slices: Slices, board: Board): Measures {
  const probe = async (points: readonly number[], toPosed: boolean) => {
    if (!app.live.client) throw new Error("not connected");
    return (await app.live.client.probe(points, { toPosed })).points;
  };
  const measures = new Measures(app.history, probe, (text) => app.say(text));
  const tool = () => slices.store.state.tool;
  new MeasureScene(app.stage, measures);
  app.tools.add(new BodyMeasureTool(app.stage, measures, tool));
  board.tool = planeMeasureTool(measures, tool);
  board.draws = [drawOnPlane(measures, (axis) => slices.lattice.step[axis]! / 2, (id) => axisOf(id as PlaneId))];
  measures.store.watch((state) => state, () => board.invalidate());
  slices.store.watch((state) => state.cursor, (cursor) => cursor && measures.store.state.draft && measures.point(cursor.point));
  app.live.onBody(() => void measures.follow());
  let identity = app.live.client?.model?.identity;
  app.live.onOpened(({ model }) => {
    if (model.identity !== identity) measures.clear();
    identity = model.identity;
  });
  // Before the keys of the tissues: Escape first lets go of what is being measured.
  app.keys.add({
    keys: ["Escape"], label: "End what is being measured, then the measuring", group: "Slices and measures",
    when: () => tool() === "distance" || tool() === "angle",
    run: () => void (measures.cancel() || slices.store.set({ tool: "cross" })),
  });
  return measures;
}
