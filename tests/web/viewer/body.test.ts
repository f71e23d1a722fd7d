// SPDX-License-Identifier: Apache-2.0
// The body in the picture: a known pixel shows a known tissue, before and after a pose; names, choice, layers and undo.
import assert from "node:assert/strict";
import { after, before, beforeEach, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client, type BodyFrame, type MeshStream, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { launch, newPage, openBody, Site, type Viewed } from "../support/page.js";
import { apart, colorAt, countColor, foremost, project } from "../support/picture.js";
import { Server, within } from "../support/server.js";

const SESSION = "viewer_body";
const ACCENT: [number, number, number] = [0x0b, 0x63, 0xc4];
let server: Server, site: Site, browser: Browser, viewed: Viewed, client: Client, model: ModelOpened, stream: MeshStream;

before(async () => {
  server = await Server.start();
  site = await Site.start(() => server.httpPort);
  client = await Client.connect(server.url);
  model = await client.open("", SESSION);  // first, so that the poses are this test's
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

beforeEach(() => viewed.page.evaluate(() => {
  const { layers, store } = (window as any).ecorche;
  layers.restore({ layers: store.state.model.tissues.map(() => ({ visible: true, opacity: 1 })), isolated: null, seeThrough: true });
  store.set({ selected: null, hovered: null, scalar: "none" });
}));

const rowOf = (name: string) => {
  const row = model.tissues.findIndex((tissue) => tissue.name === name);
  assert.ok(row >= 0, `the fixture has no ${name}`);
  return row;
};
const state = (read: string) => viewed.page.evaluate(`(${read})(window.ecorche.store.state)`);
const isolate = (...rows: number[]) => viewed.page.evaluate((each) => (window as any).ecorche.layers.isolate(each), rows);
const undo = () => viewed.page.keyboard.press("Control+z");

async function frame(): Promise<BodyFrame> {
  return stream.latest ?? within(30, new Promise<BodyFrame>((resolve) => { const off = stream.on("frame", (each) => { off(); resolve(each); }); }), "a frame");
}

/** Where the foremost point of a tissue is now, seen from the front with nothing else shown. */
async function alone(name: string): Promise<{ at: { x: number; y: number }; empty: [number, number, number]; color: [number, number, number] }> {
  const { page } = viewed, row = rowOf(name);
  const at = await project(page, foremost(await frame(), row));
  await isolate();
  const empty = await colorAt(page, at);
  await undo();
  await isolate(row);
  const color = await colorAt(page, at);
  return { at, empty, color };
}

test("a known pixel shows a known tissue, before and after a pose", async () => {
  const { page } = viewed;
  const before = await alone("hand_bones_right");
  assert.ok(apart(before.color, before.empty) > 12, `${before.color} on ${before.empty}: nothing is drawn where the hand is`);
  assert.ok(before.color[0] > before.color[2] && before.color[2] > 90, `${before.color} is not the colour of bone`);
  await page.mouse.move(before.at.x, before.at.y);
  await page.waitForFunction(() => document.querySelector("#tip")!.textContent!.includes("Hand bones, right"));
  await undo();

  const muscle = await alone("biceps_brachii_right");
  assert.ok(muscle.color[0] > 1.5 * muscle.color[1], `${muscle.color} is not the colour of muscle`);
  await undo();

  const { segments } = model.skeleton!, joint = segments.findIndex(({ name }) => name === "upper_arm_right");
  const rotation = segments.flatMap(() => [1, 0, 0, 0]);
  const axis = segments[joint].joint!.sequence[0].axis;
  rotation.splice(4 * joint, 4, Math.cos(0.5), ...[0, 1, 2].map((each) => (each === axis ? Math.sin(0.5) : 0)));
  const posed = within(30, new Promise<void>((resolve) => { stream.on("frame", (each) => each.poseSequence > 0n && resolve()); }), "the posed frame");
  client.setPose({ rotation });
  await posed;
  await page.waitForFunction(() => (window as any).ecorche.store.state.poseSequence === 1n);

  const now = await alone("hand_bones_right");
  assert.ok(Math.hypot(now.at.x - before.at.x, now.at.y - before.at.y) > 15, "the pose does not move the arm in the picture");
  assert.ok(apart(now.color, now.empty) > 12, `${now.color} on ${now.empty}: nothing is drawn where the hand went`);
  assert.ok(apart(await colorAt(page, before.at), before.empty) < 12, "the hand is still drawn where it was");
  await page.mouse.move(before.at.x, before.at.y);
  await page.waitForFunction(() => document.querySelector<HTMLElement>("#tip")!.hidden);
  await page.mouse.move(now.at.x, now.at.y);
  await page.waitForFunction(() => document.querySelector("#tip")!.textContent!.includes("Hand bones, right"));
  await undo();
});

test("what is chosen in the picture is chosen in the tree, and the other way", async () => {
  const { page } = viewed;
  await isolate(rowOf("skull"));
  const at = await project(page, foremost(await frame(), rowOf("skull")));
  await page.mouse.click(at.x, at.y);
  await page.waitForSelector(`.tree li[data-row="${rowOf("skull")}"][aria-selected="true"]`);
  assert.equal(await page.textContent(".chosen h2"), "Skull");
  assert.ok(await countColor(page, ACCENT) > 100, "the chosen tissue has no outline");
  await undo();

  await page.fill("#tissue-search", "femur l");
  await page.click(`.tree li[data-row="${rowOf("femur_left")}"] .name`);
  assert.equal(await state("(s) => s.selected"), rowOf("femur_left"));
  await page.fill("#tissue-search", "");
  await page.click("#canvas", { position: { x: 312, y: 120 } });  // between the panels, beside the body
  assert.equal(await state("(s) => s.selected"), null);
  assert.equal(await countColor(page, ACCENT), 0);
});

test("hides, isolates, looks through and takes it back", async () => {
  const { page } = viewed, skin = rowOf("skin"), thigh = rowOf("femur_right");
  const opacity = (row: number) => page.evaluate((each) => (window as any).ecorche.body.shown(each), row);
  await page.focus("#canvas");
  assert.equal(await opacity(skin), 0.25);
  await page.keyboard.press("s");
  assert.equal(await opacity(skin), 1);
  await page.evaluate((row) => (window as any).ecorche.select(row), thigh);
  await page.keyboard.press("h");
  assert.equal(await opacity(thigh), 0);
  await page.keyboard.press("i");
  assert.deepEqual([await opacity(thigh), await opacity(skin)], [1, 0]);
  for (const expected of [[0, 1], [1, 1], [1, 0.25]]) {
    await undo();
    assert.deepEqual([await opacity(thigh), await opacity(skin)], expected);
  }
  await page.keyboard.press("Control+Shift+z");
  assert.equal(await opacity(skin), 1);
  await undo();
  await page.keyboard.press("Escape");

  // A slider that is dragged is one step.
  await page.evaluate((row) => (window as any).ecorche.select(row), skin);
  for (const value of ["80", "60", "20"]) await page.fill("#opacity", value);
  assert.equal(await opacity(skin), 0.2);
  await undo();
  assert.equal(await opacity(skin), 0.25);
});

test("the surface tells the distance from rest", async () => {
  const { page } = viewed;
  const own = await Client.connect(server.url);
  try {
    await own.open();
    const rest = await own.subscribeMesh();
    const restFrame = rest.latest ?? await within(30, new Promise<BodyFrame>((resolve) => { rest.on("frame", resolve); }), "the rest pose");
    const posed = await frame(), row = rowOf("hand_bones_right");
    const before = foremostVertex(posed, row);
    const moved = Math.hypot(...[0, 1, 2].map((axis) => at(posed, before, axis) - at(restFrame, before, axis)));
    assert.ok(moved > 20, `the hand moved by ${moved} mm only`);
    // A joint's dot under the pointer has the word before the tissue.
    await page.locator("#panel-pose button", { hasText: "Joints" }).click();
    await page.selectOption("#surface", "distance");
    await page.waitForFunction(() => (window as any).ecorche.body.rest !== null);
    await isolate(row);
    const pixel = await project(page, foremost(posed, row));
    await page.mouse.move(5, 5);
    await page.mouse.move(pixel.x, pixel.y);
    await page.waitForFunction(() => /mm from rest/.test(document.querySelector("#tip")!.textContent!));
    const said = Number.parseFloat((await page.textContent("#tip small"))!);
    assert.ok(Math.abs(said - moved) < 4, `${said} mm at a vertex that moved by ${moved} mm`);
    assert.match((await page.textContent("#legend"))!, /farthest \d+/);
    await undo();
    await page.selectOption("#surface", "none");
  } finally {
    own.close();
  }
});

const at = ({ vertices, scale, offset }: BodyFrame, vertex: number, axis: number) => offset[axis] + scale * vertices[4 * vertex + axis];
function foremostVertex(posed: BodyFrame, row: number): number {
  const range = posed.layout.ranges.find(({ tissue }) => tissue === row)!;
  let best = range.firstVertex;
  for (let vertex = best; vertex < range.firstVertex + range.vertexCount; ++vertex) if (posed.vertices[4 * vertex + 1] < posed.vertices[4 * best + 1]) best = vertex;
  return best;
}

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));
