// SPDX-License-Identifier: Apache-2.0
// What the viewer knows without a picture: layers and their undo, names, colours, the scale of distances, the scanned body of a level.
import assert from "node:assert/strict";
import { test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { PoseQualitySchema } from "../../../clients/web/protocol/src/gen/ecorche/v1/stream_pb.js";
import { capsOf, restNumbers } from "../../../clients/web/viewer/src/rest.js";
import { farthestFromRest, niceRange } from "../../../clients/web/viewer/src/scene/distance.js";
import { lookOf } from "../../../clients/web/viewer/src/scene/palette.js";
import { firstState, type AppState } from "../../../clients/web/viewer/src/state/app_state.js";
import { History } from "../../../clients/web/viewer/src/state/history.js";
import { Layers, shownOpacity } from "../../../clients/web/viewer/src/state/layers.js";
import { qualityOf } from "../../../clients/web/viewer/src/state/quality.js";
import { groupOrder, labelOf, matches } from "../../../clients/web/viewer/src/state/names.js";
import { Store } from "../../../clients/web/viewer/src/state/store.js";

const tissues = ["skin", "femur_left", "biceps_brachii_left", "liver"].map((name, row) => ({
  row, name, label: labelOf(name), group: ["skin", "bone", "muscle", "organ"][row], segment: -1, vertices: 3,
}));

function withBody(): { store: Store<AppState>; layers: Layers; history: History; clock: { now: number } } {
  const clock = { now: 0 }, history = new History(() => clock.now);
  const store = new Store<AppState>({
    ...firstState(), model: { name: "body", session: "", controls: true, tissues, joints: [], segments: [] }, layers: tissues.map(() => ({ visible: true, opacity: 1 })),
  });
  return { store, history, clock, layers: new Layers(store, history) };
}
const shown = (store: Store<AppState>) => tissues.map(({ row }) => shownOpacity(store.state, row));

test("a store tells only whom it concerns", () => {
  const store = new Store({ a: 1, b: 1 }), told: [number, number][] = [];
  const stop = store.watch((state) => state.a, (value, before) => told.push([value, before]));
  store.set({ b: 2 });
  store.set({ a: 2 });
  store.set({ a: 2 });
  stop();
  store.set({ a: 3 });
  assert.deepEqual(told, [[2, 1]]);
});

test("layers are shown, hidden, isolated and seen through, and all of it is undone in order", () => {
  const { store, layers, history } = withBody();
  assert.deepEqual(shown(store), [0.25, 1, 1, 1]);
  layers.setVisible([1, 2], false);
  layers.toggleSeeThrough();
  layers.isolate([3]);
  assert.deepEqual(shown(store), [0, 0, 0, 1]);
  layers.isolate([3]);
  assert.deepEqual(shown(store), [1, 0, 0, 1]);
  assert.deepEqual([history.undo(), history.undo(), history.undo(), history.undo(), history.undo()],
    ["End of isolation", "Isolate Liver", "Solid skin", "Hide 2 tissues", null]);
  assert.deepEqual(shown(store), [0.25, 1, 1, 1]);
  assert.equal(history.redo(), "Hide 2 tissues");
  assert.deepEqual(shown(store), [0.25, 0, 0, 1]);
  layers.showAll();
  assert.equal(history.redo(), null);
});

test("a slider that is dragged is one step, two drags are two", () => {
  const { store, layers, history, clock } = withBody();
  for (const opacity of [0.9, 0.5, 0.3]) {
    clock.now += 100;
    layers.setOpacity([1], opacity);
  }
  clock.now += 5000;
  layers.setOpacity([1], 0.1);
  history.undo();
  assert.equal(shownOpacity(store.state, 1), 0.3);
  history.undo();
  assert.equal(shownOpacity(store.state, 1), 1);
  assert.equal(history.canUndo, null);
});

test("names are as a person reads them, and are found by parts of words", () => {
  assert.equal(labelOf("biceps_brachii_left"), "Biceps brachii, left");
  assert.equal(labelOf("left"), "Left");
  assert.ok(matches("Biceps brachii, left", "bra LEFT"));
  assert.ok(!matches("Biceps brachii, left", "right"));
  assert.ok(groupOrder("skin") < groupOrder("bone") && groupOrder("other") < groupOrder("of no group"));
});

test("a muscle has the colour of its other side; veins are not arteries; every group has a look", () => {
  assert.deepEqual(lookOf("biceps_brachii_left", "muscle"), lookOf("biceps_brachii_right", "muscle"));
  assert.notEqual(lookOf("biceps_brachii_left", "muscle").color, lookOf("deltoid_left", "muscle").color);
  assert.notEqual(lookOf("veins", "vessel").color, lookOf("arteries", "vessel").color);
  assert.deepEqual(lookOf("x", "of no group"), lookOf("x", "other"));
});

test("distances from rest, and a scale that holds them", () => {
  const rest = { numbers: new Uint16Array([0, 0, 0, 9, 10, 0, 0, 9]), low: [1, 2, 3] as [number, number, number], step: 0.5 };
  const posed = { numbers: new Uint16Array([0, 0, 0, 9, 10, 40, 0, 9]), low: [1, 5, 3] as [number, number, number], step: 0.5 };
  const range = { row: 0, firstVertex: 0, vertexCount: 2, firstIndex: 0, indexCount: 0 };
  assert.equal(farthestFromRest(posed, rest, [range]), 23);
  assert.deepEqual([0, 10, 11, 60, 200, 501].map(niceRange), [10, 10, 20, 100, 200, 1000]);
});

test("the scanned body comes in the order of a coarser level", () => {
  const whole = {
    layout: { level: 0, vertexCount: 4, indices: new Uint32Array(), ranges: [{ tissue: 0, firstVertex: 0, vertexCount: 1, firstIndex: 0, indexCount: 0 },
      { tissue: 2, firstVertex: 1, vertexCount: 3, firstIndex: 0, indexCount: 0 }] },
    vertices: Uint16Array.from({ length: 16 }, (_, i) => i),
  };
  const coarse = { level: 1, vertexCount: 2, indices: new Uint32Array(), ranges: [{ tissue: 2, firstVertex: 0, vertexCount: 2, firstIndex: 0, indexCount: 0, rows: new Uint32Array([0, 2]) }] };
  assert.deepEqual([...restNumbers(whole, coarse)], [4, 5, 6, 7, 12, 13, 14, 15]);
  assert.throws(() => restNumbers(whole, { ...coarse, ranges: [{ ...coarse.ranges[0], tissue: 1 }] }), /missing in the scanned body/);
});

test("caps come in the order of a level, and a model that nothing cuts has none", () => {
  const ranges = [{ tissue: 0, firstVertex: 0, vertexCount: 3, firstIndex: 0, indexCount: 0, rows: new Uint32Array([1, 9, 10]) },
    { tissue: 1, firstVertex: 3, vertexCount: 2, firstIndex: 0, indexCount: 0 }];
  const layout = { level: 1, vertexCount: 5, indices: new Uint32Array(), ranges };
  const whole = (...bits: number[]) => ({ capVertices: new Uint8Array(bits) });
  assert.deepEqual([...capsOf([whole(0b10, 0b100), whole()], layout)!], [255, 0, 255, 0, 0]);
  assert.deepEqual([...capsOf([whole(0b10), whole()], layout)!], [255, 0, 0, 0, 0], "a server may leave out the last bytes");
  assert.equal(capsOf([whole(), whole()], layout), null);
});

test("bones that run into each other are told of beyond their limit, by name", () => {
  const model = withBody().store.state.model;
  const overlaps = (mm: number) => qualityOf(create(PoseQualitySchema, { overlap: { bone: 1, into: 9, mm }, maxBoneOverlap: 5 }), model).figures
    .filter(({ name }) => name.startsWith("Overlap"));
  assert.deepEqual(overlaps(6), [{ name: "Overlap of femur, left with tissue 9", value: "6.00 mm", limit: "5.00 mm", over: true }]);
  assert.deepEqual(overlaps(5), []);
});
