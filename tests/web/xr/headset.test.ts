// SPDX-License-Identifier: Apache-2.0
// The body in an emulated headset: both eyes see it where it stands, a grip pulls it, a ray names it, a stick enlarges it, and the page is
// as it was when one leaves.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, afterEach, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { Client, type BodyFrame, type MeshStream, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { levelWithin } from "../../../clients/web/viewer/src/xr/detail.js";
import { eyesPng, hold, inBody, inRoom, pictures, point, press, seenAt, wearHeadset, type Box, type Three, type Turned } from "../support/headset.js";
import { launch, newPage, openBody, Site, type Viewed } from "../support/page.js";
import { apart, colorAt, foremost, place, project } from "../support/picture.js";
import { Server, within } from "../support/server.js";

const SESSION = "viewer_headset";
let server: Server, site: Site, browser: Browser, viewed: Viewed, page: Page, client: Client, model: ModelOpened, stream: MeshStream, box: Box;

before(async () => {
  server = await Server.start();
  site = await Site.start(() => server.httpPort);
  browser = await launch();
  viewed = await newPage(browser, site, { viewport: { width: 640, height: 360 } });
  page = viewed.page;
  await wearHeadset(page);
  await openBody(page, site, `#session=${SESSION}`);  // first, so that it is the page that poses
  client = await Client.connect(server.url);
  model = await client.open("", SESSION);
  stream = await client.subscribeMesh();
});
afterEach(async () => {
  if (await inside()) await leave();
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});

async function frame(): Promise<BodyFrame> {
  return stream.latest ?? within(30, new Promise<BodyFrame>((resolve) => { const off = stream.on("frame", (each) => { off(); resolve(each); }); }), "a frame");
}

function boxOf(body: BodyFrame): Box {
  const low: Three = [Infinity, Infinity, Infinity], high: Three = [-Infinity, -Infinity, -Infinity];
  for (let vertex = 0; vertex < body.layout.vertexCount; ++vertex) {
    place(body, vertex).forEach((value, axis) => {
      low[axis] = Math.min(low[axis], value);
      high[axis] = Math.max(high[axis], value);
    });
  }
  return { low, high };
}

const rowOf = (name: string) => {
  const row = model.tissues.findIndex((tissue) => tissue.name === name);
  assert.ok(row >= 0, `the fixture has no ${name}`);
  return row;
};
const isolate = (...rows: number[]) => page.evaluate((each) => (window as any).ecorche.layers.restore({ ...(window as any).ecorche.layers.view, isolated: each && new Set(each) }), rows);
const showAll = () => page.evaluate(() => (window as any).ecorche.layers.restore({ ...(window as any).ecorche.layers.view, isolated: null }));
const inside = () => page.evaluate(() => (window as any).ecorche.headset.store.state.inside !== null);
const words = () => page.evaluate(() => (window as any).ecorche.headset.store.state.inside.words as string[]);
const stand = () => page.evaluate(() => { const { yaw, scale } = (window as any).ecorche.headset.store.state.inside.stand; return { yaw, scale }; });
const says = () => page.evaluate(() => document.querySelector("#says")!.textContent!);
const enter = async (mode = "immersive-vr") => {
  await page.click(`#tools button[data-mode=${mode}]`);
  await page.waitForFunction(() => (window as any).ecorche.headset.store.state.inside !== null);
  await pictures(page, 3);
  box = boxOf(await frame());
};
const leave = async () => {
  await page.evaluate(() => (window as any).ecorche.headset.store.state.inside.leave());
  assert.equal(await inside(), false);
};

/** Both eyes see a tissue at its place in the room, and nothing is there without it. */
async function bothSee(name: string, of: (color: number[]) => boolean, turned?: Turned): Promise<void> {
  const at = inRoom(foremost(await frame(), rowOf(name)), box, turned);
  await isolate();
  const empty = await seenAt(page, at);
  await isolate(rowOf(name));
  const seen = await seenAt(page, at);
  await showAll();
  assert.equal(seen.length, 2, "not two eyes");
  seen.forEach(({ inside: within, color }, eye) => {
    assert.ok(within, `${name} is outside of the picture of eye ${eye}`);
    assert.ok(apart(color, empty[eye].color) > 12, `eye ${eye} sees ${color} where ${name} should be, and ${empty[eye].color} without it`);
    assert.ok(of(color), `eye ${eye}: ${color} is not the colour of ${name}`);
  });
}
const bone = ([red, , blue]: number[]) => red > blue && blue > 70;
const muscle = ([red, green]: number[]) => red > 1.5 * green;

test("the level with at most so many triangles", () => {
  const level = (number: number, triangles: number) => ({ level: number, indices: { length: 3 * triangles } });
  assert.equal(levelWithin(300_000, [level(0, 300_000)]), 0);
  assert.equal(levelWithin(300_000, [level(0, 1_100_000)]), 1);
  assert.equal(levelWithin(300_000, [level(0, 1_100_000), level(1, 310_000)]), 2);
  assert.equal(levelWithin(300_000, [level(0, 2_500_000), level(1, 700_000), level(2, 250_000)]), 2);
  assert.equal(levelWithin(10, [level(0, 2_500_000)]), 3);
});

test("both eyes see the body on the floor, before whoever looks", async () => {
  await enter();
  await bothSee("skull", bone);
  await bothSee("femur_left", bone);
  await bothSee("biceps_brachii_right", muscle);
  assert.match((await words()).join("\n"), /Squeeze at the body/);
});

test("a squeeze and a move turn the arm by as much as the hand goes", async () => {
  await enter();
  const rest = await frame(), row = rowOf("hand_bones_right"), range = rest.layout.ranges.find(({ tissue }) => tissue === row)!;
  const start = foremost(rest, row), before = rest.vertices.slice();
  const from = inRoom(start, box);
  await hold(page, "right", from);
  await pictures(page, 12);
  assert.match((await words()).join("\n"), /Take: /);
  await press(page, "right", "squeeze", 1);
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull !== null);
  const way: Three = [-0.03, 0.09, 0.12], steps = 4;
  for (let step = 1; step <= steps; ++step) {
    await hold(page, "right", from.map((value, axis) => value + (way[axis] * step) / steps) as Three);
  }
  const residual = await settled();
  await press(page, "right", "squeeze", 0);
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull === null);
  assert.ok(residual < 5, `the hand is ${residual} mm short of a place within its reach`);

  await page.waitForFunction(() => (window as any).ecorche.live.frame.poseSequence > 0n);
  const sequence = await page.evaluate(() => String((window as any).ecorche.live.frame.poseSequence));
  const posed = await within(30, (async () => {
    for (;;) {
      const latest = await frame();
      if (String(latest.poseSequence) === sequence) return latest;
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
  })(), "the posed frame");
  const vertex = Array.from({ length: range.vertexCount }, (_, i) => range.firstVertex + i)
    .find((each) => place({ ...rest, vertices: before }, each).every((value, axis) => value === start[axis]))!;
  const moved = place(posed, vertex).map((value, axis) => value - start[axis]), expected = inBody(way);
  assert.ok(Math.hypot(...expected) > 100);
  assert.ok(Math.hypot(...moved.map((value, axis) => value - expected[axis])) < 8, `the hand moved by ${moved} mm, expected ${expected}`);
  const turned = await page.evaluate(() => {
    const { asked, rig } = (window as any).ecorche.posing.poser.state;
    return rig.segments.filter((_: unknown, row: number) => Math.abs(asked.rotation[row][0]) < 0.9999).map((segment: { name: string }) => segment.name);
  });
  assert.ok(turned.some((name: string) => /arm_right/.test(name)), `turned: ${turned}`);
  assert.ok(!turned.some((name: string) => /left/.test(name)), `turned: ${turned}`);
  assert.equal(await page.evaluate(() => (window as any).ecorche.history.canUndo !== null), true);

  await keep("pull.png");
  await press(page, "right", "a-button", 1);
  await press(page, "right", "a-button", 0);
  assert.match(await says(), /Undone: Pull/);
});

/** Once the pull's newest goal is answered: what is left of the way, mm. */
async function settled(): Promise<number> {
  let last = -1;
  for (let tries = 0; tries < 100; ++tries) {
    await pictures(page, 5);
    const now = await page.evaluate(() => (window as any).ecorche.posing.drag.store.state.pull.residual as number);
    if (now === last && tries > 4) return now;
    last = now;
  }
  return last;
}

async function keep(name: string): Promise<void> {
  const folder = process.env["ECORCHE_PICTURES"];
  if (!folder) return;
  fs.mkdirSync(folder, { recursive: true });
  fs.writeFileSync(path.join(folder, name), await eyesPng(page));
}

test("a squeeze in the air takes nothing", async () => {
  await enter();
  await hold(page, "right", [0.3, 1.2, 0.4]);
  await press(page, "right", "squeeze", 1);
  assert.equal(await page.evaluate(() => (window as any).ecorche.posing.drag.store.state.pull), null);
  assert.match((await words()).join("\n"), /Nothing is within reach/);
  await press(page, "right", "squeeze", 0);
});

test("the ray and the trigger choose a tissue, and its name is in the scene", async () => {
  await enter();
  await isolate(rowOf("femur_right"));
  const goal = inRoom(foremost(await frame(), rowOf("femur_right")), box);
  await point(page, "right", [0.2, 1.2, 0.3], goal);
  await pictures(page, 3);
  await press(page, "right", "trigger", 1);
  await press(page, "right", "trigger", 0);
  assert.equal(await page.evaluate(() => (window as any).ecorche.store.state.selected), rowOf("femur_right"));
  assert.ok((await words()).includes("Femur, right"), `${await words()}`);
  await showAll();
  await keep("named.png");
  await point(page, "right", [0.2, 1.2, 0.3], [0.2, 3, 0.4]);
  await pictures(page, 3);
  await press(page, "right", "trigger", 1);
  await press(page, "right", "trigger", 0);
  assert.equal(await page.evaluate(() => (window as any).ecorche.store.state.selected), null);
  assert.ok(!(await words()).includes("Femur, right"));
});

test("the stick enlarges and turns, from the floor", async () => {
  await enter();
  const axes = (x: number, y: number) => page.evaluate((to) => (window as any).device.controllers.left.updateAxes("thumbstick", ...to), [x, y]);
  await hold(page, "right", [1, 1, 1]);
  const before = await stand();
  await axes(0, 0.1);
  await pictures(page, 3);
  assert.deepEqual(await stand(), before, "a stick at rest moves the body");
  await axes(0, 1);
  await page.waitForFunction(() => (window as any).ecorche.headset.store.state.inside.stand.scale < 0.7);
  await axes(1, 0);
  await page.waitForFunction((yaw) => (window as any).ecorche.headset.store.state.inside.stand.yaw > yaw + 0.5, before.yaw);
  await axes(0, 0);
  await pictures(page, 3);
  const now = await stand();
  assert.ok(now.scale < 0.7 && now.scale > 0.3, `${now.scale}`);
  await bothSee("skull", bone, { yaw: now.yaw - before.yaw, scale: now.scale });
  await keep("turned.png");
});

test("comes coarser, in full on demand, and the page is as it was when one leaves", async () => {
  await page.evaluate(() => (window as any).ecorche.fit("left", true));
  const look = () => page.evaluate(() => {
    const { stage, views, body } = (window as any).ecorche;
    return { place: views.place, patient: [...stage.patient.matrix.elements], width: stage.canvas.width, height: stage.canvas.height, triangles: body.topology.indices.length / 3, near: stage.camera.near, fov: stage.camera.fov };
  });
  const before = await look();
  const at = await project(page, foremost(await frame(), rowOf("skull")));
  await isolate(rowOf("skull"));
  const color = await colorAt(page, at);
  await page.evaluate((triangles) => { (window as any).ecorche.headset.triangles = triangles; }, before.triangles / 2);
  await enter();
  await page.waitForFunction((triangles) => (window as any).ecorche.body.topology.indices.length / 3 <= triangles, before.triangles / 2);
  await press(page, "left", "thumbstick", 1);
  await press(page, "left", "thumbstick", 0);
  await page.waitForFunction((triangles) => (window as any).ecorche.body.topology.indices.length / 3 === triangles, before.triangles);
  await press(page, "left", "thumbstick", 1);
  await press(page, "left", "thumbstick", 0);
  await page.waitForFunction((triangles) => (window as any).ecorche.body.topology.indices.length / 3 < triangles, before.triangles);
  await bothSee("skull", bone);
  await isolate(rowOf("skull"));
  await leave();
  await page.waitForFunction((triangles) => (window as any).ecorche.body.topology.indices.length / 3 === triangles, before.triangles);
  assert.deepEqual(await look(), before);
  assert.ok(apart(await colorAt(page, at), color) < 12);
  await showAll();
  await page.focus("#canvas");
  await page.keyboard.press("ArrowLeft");
  assert.notDeepEqual((await look()).place, before.place, "the page no longer turns");
});

test("hands that the headset sees take between thumb and finger", async () => {
  await page.evaluate(() => { (window as any).device.primaryInputMode = "hand"; });
  await enter();
  await hold(page, "left", inRoom(foremost(await frame(), rowOf("hand_bones_left")), box), "hands");
  await page.evaluate(() => (window as any).device.hands.left.updatePinchValue(1));
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull !== null);
  await keep("hands.png");
  const segment = await page.evaluate(() => { const { posing } = (window as any).ecorche; return posing.poser.state.rig.segments[posing.drag.store.state.pull.segment].name; });
  assert.match(segment, /left/);
  await page.evaluate(() => (window as any).device.hands.left.updatePinchValue(0));
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull === null);
  await leave();
  await page.evaluate(() => { (window as any).device.primaryInputMode = "controller"; });
});

test("in one's own room nothing is behind the body", async () => {
  await enter("immersive-ar");
  await bothSee("skull", bone);
  await isolate();
  const [{ color }] = await seenAt(page, inRoom([0, 0, box.high[2]], box));
  assert.deepEqual(color, [0, 0, 0]);
  await showAll();
  // Down to the feet, where the plate lies.
  await page.evaluate(() => {
    const { quaternion } = (window as any).device, [y, w] = [quaternion.y, quaternion.w], [sin, cos] = [Math.sin(-0.35), Math.cos(-0.35)];
    quaternion.set(w * sin, y * cos, -y * sin, w * cos);
  });
  await pictures(page, 2);
  await keep("room.png");
  await leave();
});

test("a session that is refused is said in words, and the page goes on", async () => {
  const refuse = (name: string) => page.evaluate((error) => {
    navigator.xr!.requestSession = () => Promise.reject(new DOMException("no", error));
  }, name);
  await refuse("NotAllowedError");
  await page.click("#tools button[data-mode=immersive-vr]");
  await page.waitForFunction(() => /VR did not start: it was not allowed\. Allow this page/.test(document.querySelector("#says")!.textContent!));
  await refuse("NotSupportedError");
  await page.click("#tools button[data-mode=immersive-ar]");
  await page.waitForFunction(() => /AR did not start: the headset lacks what is needed/.test(document.querySelector("#says")!.textContent!));
  assert.equal(await inside(), false);
  assert.equal(await page.evaluate(() => (window as any).ecorche.stage.immersed), false);
});

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));

test("without a headset there is no button, and the help says why", async () => {
  const plain = await newPage(browser, site, { viewport: { width: 720, height: 400 } });
  await openBody(plain.page, site);
  await plain.page.waitForFunction(() => (window as any).ecorche.headset.store.state.why["immersive-vr"] !== undefined);
  for (const mode of ["immersive-vr", "immersive-ar"]) assert.equal(await plain.page.isVisible(`#tools button[data-mode=${mode}]`), false);
  await plain.page.focus("#canvas");
  await plain.page.keyboard.press("?");
  const help = (await plain.page.textContent("dialog"))!;
  assert.match(help, /VR: No headset is there\. Connect one/);
  assert.match(help, /AR: This device shows nothing within the room/);
  assert.ok(![...plain.files].some((file) => /headset-/.test(file)), "what is for headsets was loaded without one");
  assert.deepEqual(plain.faults, []);
  await plain.page.context().close();
});
