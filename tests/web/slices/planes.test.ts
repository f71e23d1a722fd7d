// SPDX-License-Identifier: Apache-2.0
// Planes from the server against the volume that the program poses, pixel by pixel; windows; measures in the posed body and in the scan.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import path from "node:path";
import { after, before, beforeEach, test } from "node:test";
import { parse } from "yaml";
import { Client, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { wireOf } from "../../../clients/web/viewer/src/posing/pose.js";
import { presets, type Library } from "../../../clients/web/viewer/src/posing/presets.js";
import { rigOf, type Rig } from "../../../clients/web/viewer/src/posing/rig.js";
import type { Vec3 } from "../../../clients/web/viewer/src/posing/rotation.js";
import { table, valueOf, valuesOf, type Measure } from "../../../clients/web/viewer/src/slices/measure.js";
import { Measures } from "../../../clients/web/viewer/src/slices/measures.js";
import { fieldRound, latticeOf, ORIENTATIONS, pixelOf, planeThrough, pointAt, snap, type Lattice, type PlaneGeometry } from "../../../clients/web/viewer/src/slices/plane.js";
import { PlaneFeed, type PlanePicture } from "../../../clients/web/viewer/src/slices/plane_feed.js";
import { CT_PRESETS, greyOf, paint, windowRound } from "../../../clients/web/viewer/src/slices/window.js";
import { History } from "../../../clients/web/viewer/src/state/history.js";
import library from "../../../io/case/data/poses.yaml";
import { readNrrd } from "../support/nrrd.js";
import { scratch } from "../support/page.js";
import { Server, within } from "../support/server.js";

const BIN = process.env["ECORCHE_BIN"]!, MODEL = process.env["ECORCHE_MODEL"]!;
let server: Server, client: Client, model: ModelOpened, lattice: Lattice;

before(async () => {
  server = await Server.start();
});
// A session of its own for each.
beforeEach(async () => {
  client?.close();
  client = await Client.connect(server.url);
  model = await client.open();
  lattice = latticeOf(model.volumes.find(({ name }) => name === "ct")!.grid!);
});
after(async () => {
  client?.close();
  await server?.stop();
});

const sitting = (rig: Rig) => presets(parse(library) as Library, rig).find(({ name }) => name === "sitting")!.pose;

function collect(): { feed: PlaneFeed; pictures: PlanePicture[]; until(done: (pictures: PlanePicture[]) => boolean, what: string): Promise<void> } {
  const pictures: PlanePicture[] = [], problems: string[] = [], watchers = new Set<() => void>();
  const feed = new PlaneFeed((picture) => {
    pictures.push(picture);
    for (const watcher of [...watchers]) watcher();
  }, (problem) => problems.push(problem));
  feed.follow(client);
  return {
    feed, pictures,
    until: (done, what) => within(60, new Promise<void>((resolve) => {
      const check = () => {
        assert.deepEqual(problems, []);
        if (!done(pictures)) return;
        watchers.delete(check);
        resolve();
      };
      watchers.add(check);
      check();
    }), what),
  };
}

test("every pixel of the three planes is the voxel that the program poses, in CT and labels", async () => {
  const folder = scratch(), rig = rigOf(model.skeleton!), volumes = ["ct", "labels"];
  const out = path.join(folder, "posed");
  execFileSync(BIN, ["pose", MODEL, "-o", out, "--pose", "lib:sitting", "--tissues", "none", "--volumes", volumes.join(",")], { stdio: "pipe" });
  client.setPose(wireOf(sitting(rig)));

  const offline = new Map(volumes.map((name) => [name, readNrrd(path.join(out, `${name}.nrrd`))]));
  const { origin, spacing, sizes } = offline.get("ct")!;
  const high = origin.map((value, axis) => value + spacing[axis] * (sizes[axis] - 1)) as unknown as Vec3;
  const field = fieldRound({ low: origin, high }, lattice, 2), cross: Vec3 = [-80, -20, 900];
  const planes = ORIENTATIONS.map((each) => planeThrough(each, cross, field, lattice));
  const { feed, pictures, until } = collect();
  feed.want(planes, volumes);
  await until((all) => all.filter(({ poseSequence }) => poseSequence === 1n).length >= 6, "six planes of the pose");
  for (const plane of planes) {
    for (const volume of volumes) {
      const { values } = pictures.filter((each) => each.volume === volume && each.plane.id === plane.id).at(-1)!;
      let compared = 0, inBody = 0;
      for (let row = 0; row < plane.height; ++row) {
        for (let column = 0; column < plane.width; ++column) {
          const expected = offline.get(volume)!.at(pointAt(plane, column, row)), is = values[row * plane.width + column];
          if (Number.isNaN(expected)) continue;
          ++compared;
          if (expected !== (volume === "ct" ? -1000 : 0)) ++inBody;
          // Trilinear weights are computed along other rows: the last digit of an integer may differ.
          assert.ok(Math.abs(is - expected) <= (volume === "ct" ? 1 : 0), `${volume}, ${plane.id}, pixel ${column}, ${row}: ${is}, offline ${expected}`);
        }
      }
      assert.ok(compared > 2000 && inBody > 300, `${volume}, ${plane.id}: ${compared} pixels compared, ${inBody} of them in the body`);
    }
  }
  feed.want([], []);
});

test("planes follow the cross-hair and the pose, the newest wish wins", async () => {
  const field = fieldRound({ low: [-300, -200, 0], high: [300, 200, 1800] }, lattice, 0);
  const at = (z: number) => planeThrough(ORIENTATIONS[0]!, [0, 0, z], field, lattice);
  const { feed, pictures, until } = collect();
  for (let z = 800; z <= 1400; z += 6) feed.want([at(z)], ["ct"]);
  const last = at(1400);
  await until((all) => all.at(-1)?.plane.origin[2] === last.origin[2], "the last plane");
  assert.ok(pictures.length < 20, `${pictures.length} of 101 planes came: they queue`);
  const before = pictures.length;
  client.setPose({ rotation: model.skeleton!.segments.flatMap(() => [1, 0, 0, 0]) });
  await until((all) => all.length > before && all.at(-1)!.poseSequence === 1n, "the plane of the next pose");
  feed.want([], []);
});

test("planes lie at voxels, with the patient's left at the right, and pixels go there and back", () => {
  const turned = latticeOf({
    $typeName: "ecorche.v1.Grid", sizeI: 9, sizeJ: 9, sizeK: 9, origin: { $typeName: "ecorche.v1.Vector3", x: 1, y: 2, z: 3 },
    spacing: { $typeName: "ecorche.v1.Vector3", x: 0.5, y: 1, z: 2 }, direction: [0, 1, 0, -1, 0, 0, 0, 0, 1],
  });
  assert.deepEqual(turned.step, [1, 0.5, 2]);
  assert.deepEqual(snap([1.6, 2.2, 5.9], turned), [2, 2, 5]);
  const field = fieldRound({ low: [-10, -10, -10], high: [10, 10, 10] }, turned, 1);
  for (const orientation of ORIENTATIONS) {
    const plane = planeThrough(orientation, [1.6, 2.2, 5.9], field, turned);
    const point = pointAt(plane, 3, 5), { column, row, off } = pixelOf(plane, point);
    assert.deepEqual([column, row, off].map((value) => Math.round(1e9 * value) / 1e9), [3, 5, 0]);
  }
  const edge = (plane: PlaneGeometry, side: 0 | 1) => pointAt(plane, side * (plane.width - 1), 0);
  const [axial, coronal, sagittal] = ORIENTATIONS.map((each) => planeThrough(each, [0, 0, 0], field, turned));
  assert.ok(edge(axial, 1)[0] > edge(axial, 0)[0] && edge(coronal, 1)[0] > edge(coronal, 0)[0], "the left is not at the right");
  assert.ok(edge(sagittal, 1)[1] > edge(sagittal, 0)[1], "the front is not at the left");
  assert.ok(pointAt(coronal, 0, 0)[2] > pointAt(coronal, 0, 5)[2] && pointAt(axial, 0, 0)[1] < pointAt(axial, 0, 5)[1]);
});

test("windows are DICOM's, and paint greys with labels over them", () => {
  const window = { level: 40, width: 400 };
  // (x - (c - 0.5)) / (w - 1) + 0.5, PS3.3 C.11.2.1.2.1
  assert.deepEqual([-161, -160, 40, 239, 240].map((value) => greyOf(value, window)), [0, 0, 128, 255, 255]);
  assert.equal(greyOf(100, window), Math.round(((100 - 39.5) / 399 + 0.5) * 255));
  assert.deepEqual(CT_PRESETS.map(({ name, width, level }) => [name, width, level]), [["Soft tissue", 400, 40], ["Bone", 1800, 400], ["Lung", 1500, -600], ["Brain", 80, 40]]);
  const out = new Uint8ClampedArray(16);
  const overlay = { labels: new Uint8Array([0, 0, 7, 8]), colors: new Map([[7, [200, 0, 0] as const]]), opacity: 0.5 };
  paint({ values: new Int16Array([-1000, 40, 40, -1000]), background: -1000, window, overlay }, out);
  assert.deepEqual([...out], [0, 0, 0, 0, 128, 128, 128, 255, 164, 64, 64, 255, 0, 0, 0, 255]);
  assert.deepEqual(windowRound(Int16Array.from({ length: 1000 }, (_, i) => i), 0), { level: 500, width: 980 });
});

test("distances and angles are true in the posed body and in the scan, and follow the pose", async () => {
  const said: string[] = [], history = new History();
  const measures = new Measures(history, async (points, toPosed) => (await client.probe(points, { toPosed })).points, (text) => said.push(text));
  const joint = (name: string) => {
    const { x, y, z } = model.skeleton!.segments.find((segment) => segment.name === name)!.joint!.center!;
    return [x, y, z] as Vec3;
  };
  const hip = joint("thigh_right"), knee = joint("shank_right"), ankle = joint("foot_right");
  await measures.add("distance", [hip]);
  await measures.add("distance", [ankle]);
  for (const point of [hip, knee, ankle]) await measures.add("angle", [point]);
  const { list } = measures.store.state;
  assert.equal(list.length, 2);
  const near = (is: number | null, expected: number, what: string) => assert.ok(is !== null && Math.abs(is - expected) < 2e-3, `${what}: ${is}, expected ${expected}`);
  near(valuesOf(list[0]).posed, Math.hypot(...hip.map((value, axis) => value - ankle[axis])), "hip to ankle at rest");
  near(valuesOf(list[0]).scanned, valuesOf(list[0]).posed, "the same in the scan");

  const stream = await client.subscribeMesh({ tissues: ["skin"], level: 3 });
  const posed = within(60, new Promise<void>((resolve) => { stream.on("frame", ({ poseSequence }) => poseSequence === 1n && resolve()); }), "the pose");
  client.setPose(wireOf(sitting(rigOf(model.skeleton!))));
  await posed;
  await measures.follow();
  const moved = measures.store.state.list;
  const truth = (await client.probe([...hip, ...knee, ...ankle], { toPosed: true })).points;
  const [a, b, c] = [0, 3, 6].map((at) => [...truth.subarray(at, at + 3)] as unknown as Vec3);
  near(valuesOf(moved[0]).posed, Math.hypot(...a.map((value, axis) => value - c[axis])), "hip to ankle, sitting");
  assert.ok(Math.abs(valuesOf(moved[0]).posed - valuesOf(list[0]).posed) > 100, "the measure did not follow the leg");
  near(valuesOf(moved[0]).scanned, valuesOf(list[0]).posed, "scanned, sitting");
  near(valuesOf(moved[1]).posed, valueOf("angle", [a, b, c]), "the knee's angle");

  // A point outside of the body stays, and has no place in the scan.
  await measures.add("distance", [[900, 0, 900]]);
  await measures.add("distance", [[900, 30, 940]]);
  const outside = measures.store.state.list[2]!;
  near(valuesOf(outside).posed, 50, "in the air");
  assert.equal(valuesOf(outside).scanned, null);
  assert.match(table(measures.store.state.list), /\n3\tdistance\tmm\t50\.00\t\t900\.00 0\.00 900\.00; 900\.00 30\.00 940\.00\t; $/);
  measures.remove([outside.id]);
  assert.equal(measures.store.state.list.length, 2);
  history.undo();
  assert.equal(measures.store.state.list.length, 3);
  assert.deepEqual(said.filter((text) => /not|could/.test(text)), []);
});

test("an angle is that of its corner", () => {
  const right: Measure = { id: 1, kind: "angle", points: [[10, 0, 0], [0, 0, 0], [0, 0, 4]].map((posed) => ({ posed: posed as unknown as Vec3, rest: null })) };
  assert.ok(Math.abs(valuesOf(right).posed - Math.PI / 2) < 1e-12);
  assert.equal(valuesOf(right).scanned, null);
});
