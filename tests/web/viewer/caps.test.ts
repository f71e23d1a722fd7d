// SPDX-License-Identifier: Apache-2.0
// Where the border of the scan cuts the body, the picture shows no skin: a flat colour that the tree names and the pointer tells, posed or
// not, near and coarse; and files that are saved have it apart.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client, type BodyFrame, type MeshStream, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { CAP_COLOR, CAP_LABEL } from "../../../clients/web/viewer/src/scene/palette.js";
import { launch, newPage, openBody, scratch, Site, type Viewed } from "../support/page.js";
import { apart, colorAt, project, type Rgb } from "../support/picture.js";
import { Server } from "../support/server.js";
import { makeStump, STUMP } from "../support/stump.js";

const SESSION = "viewer_caps";
const CAP: Rgb = [(CAP_COLOR >> 16) & 255, (CAP_COLOR >> 8) & 255, CAP_COLOR & 255];
const ON_CAP: Rgb = [STUMP.axis + 20, STUMP.axis, STUMP.top], ON_SIDE: Rgb = [STUMP.axis, STUMP.axis - STUMP.radius, STUMP.top - 60];
let server: Server, site: Site, browser: Browser, viewed: Viewed, client: Client, model: ModelOpened, stream: MeshStream;

before(async () => {
  server = await Server.start([], { model: makeStump(scratch()) });
  site = await Site.start(() => server.httpPort);
  client = await Client.connect(server.url);
  model = await client.open("", SESSION);
  stream = await client.subscribeMesh();
  browser = await launch();
  viewed = await newPage(browser, site);
  await openBody(viewed.page, site, `#session=${SESSION}`);
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});

const look = (side: string) => viewed.page.evaluate((from) => (window as any).ecorche.fit(from, true), side);
const seeThrough = (on: boolean) => viewed.page.evaluate((each) => (window as any).ecorche.store.set({ seeThrough: each }), on);

test("a cap is no skin, by its colour and by the pointer", async () => {
  const { page, faults } = viewed;
  assert.equal(await page.isVisible(".cut"), true);
  assert.equal(await page.textContent(".cut"), CAP_LABEL);
  await seeThrough(false);
  await look("top");
  const cap = await project(page, ON_CAP);
  assert.ok(apart(await colorAt(page, cap), CAP) < 3, `${await colorAt(page, cap)} is not ${CAP}`);
  await page.mouse.move(cap.x, cap.y);
  await page.waitForFunction((label) => document.querySelector("#tip")!.textContent!.includes(label), CAP_LABEL);
  assert.match((await page.textContent("#tip"))!, /no skin/);
  // The bone ends in the same plane, and comes through nowhere; in its middle is the mark of the joint.
  for (let x = -8; x <= 8; x += 2) {
    for (let y = -8; y <= 8; y += 2) {
      if (Math.hypot(x, y) < 5) continue;
      const there = await colorAt(page, await project(page, [STUMP.axis + x, STUMP.axis + y, STUMP.top]));
      assert.ok(apart(there, CAP) < 3, `${there} is not ${CAP}, ${x} and ${y} mm off the axis`);
    }
  }

  await look("front");
  const side = await project(page, ON_SIDE), skin = await colorAt(page, side);
  assert.ok(apart(skin, CAP) > 40 && skin[0] > skin[2], `${skin} is not the colour of skin`);
  await page.mouse.move(side.x, side.y);
  await page.waitForFunction(() => document.querySelector("#tip")!.textContent!.startsWith("Skin"));

  // Seen through, it hides no more than it must, but is still told from the skin; numbers on the surface leave it out.
  await seeThrough(true);
  await look("top");
  const through = await colorAt(page, await project(page, ON_CAP));
  assert.ok(through[2] > through[0] && apart(through, CAP) > 3, `${through} is no glass of ${CAP}`);
  await seeThrough(false);
  await page.selectOption("#surface", "distance");
  await page.waitForFunction(() => (window as any).ecorche.body.scalar === "distance");
  assert.ok(apart(await colorAt(page, await project(page, ON_CAP)), CAP) < 3);
  await page.selectOption("#surface", "none");
  assert.deepEqual(faults, []);
});

test("it goes with a pose, and stands at every level of detail", async () => {
  const { page } = viewed;
  const { segments } = model.skeleton!, half = Math.SQRT1_2;
  await seeThrough(false);
  client.setPose({ rotation: segments.flatMap((_, row) => (row === 0 ? [half, half, 0, 0] : [1, 0, 0, 0])) });
  await page.waitForFunction(() => (window as any).ecorche.store.state.poseSequence === 1n);
  // A quarter turn about x through the hip: what looked up looks to the front.
  await look("front");
  const turned: Rgb = [ON_CAP[0], STUMP.hip[1] - (ON_CAP[2] - STUMP.hip[2]), STUMP.hip[2] + (ON_CAP[1] - STUMP.hip[1])];
  const seen = await colorAt(page, await project(page, turned));
  assert.ok(apart(seen, CAP) < 3, `${seen} is not ${CAP}`);
  client.setPose({ rotation: segments.flatMap(() => [1, 0, 0, 0]) });
  await page.waitForFunction(() => (window as any).ecorche.store.state.poseSequence === 2n);

  const bits = model.tissues[0]!.capVertices, marked = (row: number) => (bits[row >> 3]! >> (row & 7)) & 1;
  assert.ok(bits.length >= Number(model.tissues[0]!.vertices) / 8);
  for (const level of [1, 2]) {
    const coarse = await client.subscribeMesh({ tissues: ["skin"], level });
    const frame = coarse.latest ?? await new Promise<BodyFrame>((resolve) => { const off = coarse.on("frame", (each) => { off(); resolve(each); }); });
    const { indices, ranges: [range] } = frame.layout, rows = range!.rows!;
    let area = 0;
    const at = (corner: number) => [0, 1].map((axis) => frame.offset[axis]! + frame.scale * frame.vertices[4 * corner + axis]!);
    for (let i = 0; i < indices.length; i += 3) {
      const corners = [indices[i]!, indices[i + 1]!, indices[i + 2]!];
      if (!corners.every((corner) => marked(rows[corner]!))) continue;
      const [[ax, ay], [bx, by], [cx, cy]] = corners.map(at) as [number, number][] as [[number, number], [number, number], [number, number]];
      area += ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / 2;
    }
    const round = Math.PI * STUMP.radius ** 2;
    assert.ok(Math.abs(area - round) < 0.15 * round, `level ${level}: caps of ${area} mm2, the limb's section has ${round}`);
  }
});

test("a saved GLB has the caps apart from the skin", async () => {
  const { page } = viewed;
  await page.evaluate(() => (window as any).ecorche.layers.isolate([0]));
  const coming = page.waitForEvent("download");
  await page.click("#tools button[aria-label^=Save]");
  await page.click(".menu >> text=colours");
  const file = path.join(scratch(), "stump.glb");
  await (await coming).saveAs(file);
  const glb = fs.readFileSync(file), json = JSON.parse(glb.toString("utf8", 20, 20 + glb.readUInt32LE(12)));
  const meshes = json.nodes.filter((node: { mesh?: number }) => node.mesh !== undefined);
  assert.deepEqual(meshes.map((node: { name: string }) => node.name), ["skin", "skin_cap"]);
  const positions = json.accessors[json.meshes[meshes[1].mesh].primitives[0].attributes.POSITION];
  assert.ok(positions.max[1] < 0.001 * (STUMP.top + 1), `the caps reach ${positions.max}`);
  const triangles = json.accessors[json.meshes[meshes[1].mesh].primitives[0].indices].count / 3;
  const range = stream.latest!.layout.ranges[0]!;
  assert.ok(triangles > 10 && triangles < 0.4 * range.indexCount / 3, `${triangles} triangles of ${range.indexCount / 3} are caps`);
  await page.evaluate(() => (window as any).ecorche.layers.isolate([0]));
});

test("a body that nothing cuts has no such word", async () => {
  const whole = await Server.start(), there = await Site.start(() => whole.httpPort), { page, faults } = await newPage(browser, there);
  try {
    await openBody(page, there);
    assert.equal(await page.isVisible(".cut"), false);
    assert.deepEqual(faults, []);
  } finally {
    await page.context().close();
    there.stop();
    await whole.stop();
  }
});
