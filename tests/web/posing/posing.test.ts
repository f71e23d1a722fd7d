// SPDX-License-Identifier: Apache-2.0
// Posing in Chromium against the real server: rings, fields and limits, pulls and pins, undo, files, links. Pictures go to ECORCHE_PICTURES.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { after, before, beforeEach, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { Client, type BodyFrame, type MeshStream, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { move } from "../../../clients/web/viewer/src/posing/forward.js";
import { launch, newPage, openBody, scratch, Site, type Viewed } from "../support/page.js";
import { foremost, place, project } from "../support/picture.js";
import { Server, within } from "../support/server.js";

type Three = [number, number, number];
const SESSION = "posing";
const folder = scratch();
let server: Server, site: Site, browser: Browser, viewed: Viewed, page: Page, client: Client, model: ModelOpened, stream: MeshStream;

before(async () => {
  server = await Server.start();
  site = await Site.start(() => server.httpPort);
  browser = await launch();
  viewed = await newPage(browser, site, { viewport: { width: 840, height: 560 }, hasTouch: true });
  ({ page } = viewed);
  await openBody(page, site, `#session=${SESSION}`);
  // Looks on: what it sees is what the server made of the page's poses.
  client = await Client.connect(server.url);
  model = await client.open("", SESSION);
  stream = await client.subscribeMesh();
  // Bones alone: software GL is slow.
  await page.evaluate((rows) => (window as any).ecorche.layers.isolate(rows), model.tissues.flatMap(({ group }, row) => (group === "bone" ? [row] : [])));
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});
beforeEach(async () => {
  await page.evaluate(() => (window as any).ecorche.posing.poser.resetAll());
  await page.evaluate(() => (window as any).ecorche.panels.open("pose"));
  await drawn();
});

const angle = (joint: string, at = 0): Promise<number> => page.evaluate(([name, i]) => {
  const { poser } = (window as any).ecorche.posing;
  return (poser.angle(poser.state.rig.segments.findIndex((s: any) => s.joint.name === name), i) * 180) / Math.PI;
}, [joint, at] as const);
/** Chooses a joint, and waits until its rings are drawn. */
async function choose(joint: string): Promise<void> {
  await page.evaluate((name) => {
    const { poser } = (window as any).ecorche.posing;
    poser.select(poser.state.rig.segments.findIndex((s: any) => s.joint.name === name));
  }, joint);
  await drawn();
}
/** A picture of what is so now. */
const drawn = () => page.evaluate(() => new Promise<void>((resolve) => {
  const { stage } = (window as any).ecorche;
  const off = stage.onAfterDraw(() => { off(); resolve(); });
  stage.invalidate();
}));

/** What is left of the way of the pull under way, once the server has answered for the newest target. */
async function pulled(): Promise<{ residual: number; target: Three; reached: Three; segment: number }> {
  await page.waitForTimeout(100);
  return page.evaluate(async () => {
    const { drag } = (window as any).ecorche.posing;
    await drag.settled();
    return drag.store.state.pull;
  });
}
const said = () => page.locator("#says").textContent();
const jointOf = (name: string) => model.skeleton!.segments.find(({ joint }) => joint!.name === name)!.joint!;
const center = (name: string): Three => {
  const { x, y, z } = jointOf(name).center!;
  return [x, y, z];
};
const tissue = (name: string) => model.tissues.findIndex((each) => each.name === name);

/** The frame that shows what the page asked for last. */
async function frame(): Promise<BodyFrame> {
  await page.waitForTimeout(100);
  const asked = await page.evaluate(() => String((window as any).ecorche.live.client.poses.sequence));
  return within(30, (async () => {
    while (!stream.latest || stream.latest.poseSequence < BigInt(asked)) await new Promise((resolve) => setTimeout(resolve, 20));
    return stream.latest;
  })(), `pose ${asked}`);
}
/** All vertices of a tissue, mm. */
function vertices(shown: BodyFrame, name: string): Three[] {
  const range = shown.layout.ranges.find((each) => each.tissue === tissue(name))!;
  return Array.from({ length: range.vertexCount }, (_, i) => place(shown, range.firstVertex + i));
}
const distance = (a: readonly number[], b: readonly number[]) => Math.hypot(...a.map((x, i) => x - b[i]!));

/** Drags by way of some points, so that the page sees a pointer that moves. */
async function drag(from: { x: number; y: number }, to: { x: number; y: number }[]): Promise<void> {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  for (const at of to) await page.mouse.move(at.x, at.y, { steps: 2 });
  await page.mouse.up();
}

/** Where the handle of the chosen joint's ring is in the picture, and places on the ring by so many degrees from there. */
async function onRing(ring: number, degrees: number): Promise<{ x: number; y: number }> {
  return page.evaluate(([index, turn]) => {
    const { scene } = (window as any).ecorche.posing;
    const at = scene.placeOnRing(index, (turn * Math.PI) / 180);
    const { left, top } = document.querySelector("#canvas")!.getBoundingClientRect();
    return { x: at.x + left, y: at.y + top };
  }, [ring, degrees] as const);
}

async function picture(name: string): Promise<void> {
  const to = process.env["ECORCHE_PICTURES"];
  if (to) await page.screenshot({ path: path.join(to, `${name}.png`) });
}

test("a ring that is dragged sends the pose, and the mesh moves by the millimetres expected", async () => {
  const rest = vertices(await frame(), "tibia_left");
  await choose("knee_left");
  await page.keyboard.press("2");
  await drawn();
  await drag(await onRing(0, 0), [await onRing(0, 15), await onRing(0, 32), await onRing(0, 40)]);
  const turned = await angle("knee_left");
  assert.ok(Math.abs(turned - 40) < 2, `${turned} degrees`);
  await picture("ring");
  // A bone turns rigidly about the knee's axis: each vertex goes by twice its distance from the axis times the sine of half the angle.
  const { axisX } = jointOf("knee_left"), axis = [axisX!.x, axisX!.y, axisX!.z];
  const posed = vertices(await frame(), "tibia_left"), middle = center("knee_left");
  rest.forEach((vertex, i) => {
    const arm = vertex.map((x, k) => x - middle[k]!), along = arm.reduce((sum, x, k) => sum + x * axis[k]!, 0);
    const radius = Math.hypot(...arm.map((x, k) => x - along * axis[k]!));
    const expected = 2 * radius * Math.sin((turned * Math.PI) / 360);
    assert.ok(Math.abs(distance(vertex, posed[i]!) - expected) < 0.2, `vertex ${i} went ${distance(vertex, posed[i]!)} mm, expected ${expected}`);
  });
  assert.ok(Math.max(...rest.map((vertex, i) => distance(vertex, posed[i]!))) > 200);
});

test("one gesture is one step to undo", async () => {
  await choose("knee_left");
  await drag(await onRing(0, 0), [await onRing(0, 20), await onRing(0, 30)]);
  const turned = await angle("knee_left");
  assert.ok(turned > 20);
  await page.keyboard.press("Control+z");
  assert.ok(Math.abs(await angle("knee_left")) < 1e-6);
  assert.match((await said())!, /Undone: Knee, left: Flexion/);
  await page.keyboard.press("Control+Shift+z");
  assert.ok(Math.abs((await angle("knee_left")) - turned) < 1e-6);
});

test("Escape takes a gesture back", async () => {
  await choose("knee_left");
  const from = await onRing(0, 0), to = await onRing(0, 40);
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(to.x, to.y, { steps: 2 });
  assert.ok((await angle("knee_left")) > 20);
  await page.keyboard.press("Escape");
  await page.mouse.up();
  assert.ok(Math.abs(await angle("knee_left")) < 1e-6);
});

test("a limit holds the ring and says so", async () => {
  await choose("knee_left");
  const past = await Promise.all([45, 90, 120, 150, 170].map((degrees) => onRing(0, degrees)));
  await drag(await onRing(0, 0), past);
  assert.ok(Math.abs((await angle("knee_left")) - 135) < 1e-6);
  assert.equal(await said(), "Knee, left: flexion stops at 135°, its limit");
  assert.match((await page.locator(".joint-editor .note").textContent())!, /stops at 135°/);
  assert.ok(await page.locator(".angle .stop").isVisible());
  assert.match((await page.locator(".scene-label[data-kind^='ring']").first().textContent())!, /Flexion 135° \(limit\)/);
  await picture("limit");
});

test("typed degrees do the same, by the keyboard alone", async () => {
  await page.locator(".tree.joints [data-joint]", { hasText: "Hip, left" }).focus();
  await page.keyboard.press("Enter");
  const field = page.locator("#angle-hip_left-flexion");
  await field.fill("45");
  await page.keyboard.press("Enter");
  assert.ok(Math.abs((await angle("hip_left")) - 45) < 1e-6);
  await page.keyboard.press("ArrowUp");
  await page.keyboard.press("Shift+ArrowUp");
  assert.ok(Math.abs((await angle("hip_left")) - 56) < 1e-6);
  await field.fill("400");
  await page.keyboard.press("Enter");
  assert.ok(Math.abs((await angle("hip_left")) - 120) < 1e-6);
  assert.equal(await field.inputValue(), "120");
  assert.equal(await said(), "Hip, left: flexion stops at 120°, its limit");
  await field.fill("much");
  await page.keyboard.press("Enter");
  assert.equal(await field.getAttribute("aria-invalid"), "true");
  assert.ok(Math.abs((await angle("hip_left")) - 120) < 1e-6);
  const adduction = page.locator("#angle-hip_left-adduction");
  await adduction.fill("-20");
  await page.keyboard.press("Enter");
  assert.match((await page.locator(".joint-editor").textContent())!, /Abduction 20°/);
  await page.keyboard.press("Escape");
});

test("a hand that is pulled comes to where the pointer is, within a millimetre", async () => {
  await page.keyboard.press("1");
  await drawn();
  const wrist = center("wrist_left"), target: Three = [wrist[0] + 60, wrist[1], wrist[2] + 240];
  const from = await project(page, wrist);
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move((await project(page, target)).x, (await project(page, target)).y, { steps: 3 });
  const pull = await pulled();
  await picture("pull");
  await page.mouse.up();
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull === null);
  assert.ok(pull.residual < 1, `${pull.residual} mm are left`);
  assert.ok(distance(pull.target, pull.reached) < 1 && distance(pull.reached, wrist) > 200);
  // The picture agrees: the wrist is under the pointer.
  const shown = await page.evaluate(() => {
    const { poser } = (window as any).ecorche.posing;
    const row = poser.state.rig.segments.findIndex((s: any) => s.joint.name === "wrist_left");
    return { motion: poser.state.motions[row], wrist: poser.state.rig.segments[row].joint.center };
  });
  const there = await project(page, [...move(shown.motion, shown.wrist)] as Three);
  const asked = await project(page, target);
  assert.ok(distance([there.x, there.y], [asked.x, asked.y]) < 2, `in the picture at ${there.x}, ${there.y}; the pointer was at ${asked.x}, ${asked.y}`);
  const away = vertices(await frame(), "hand_bones_left")[0]!;
  await page.keyboard.press("Control+z");
  assert.match((await said())!, /Undone: Pull hand, left/);
  const back = vertices(await frame(), "hand_bones_left")[0]!;
  assert.ok(distance(away, back) > 150, `the hand is ${distance(away, back)} mm from where it was pulled to`);
});

test("what is pinned stays while another part is pulled, and what is beyond reach is told", async () => {
  await page.keyboard.press("1");
  await drawn();
  const rest = await frame(), feet = vertices(rest, "foot_bones_left"), hand = vertices(rest, "hand_bones_left")[0]!;
  for (const foot of ["ankle_left", "ankle_right"]) {
    await choose(foot);
    await page.keyboard.press("k");
  }
  assert.equal(await page.locator(".pins li").count(), 2);
  assert.ok(await page.locator("#move-root").isChecked());
  // Down beside the knee: further than the arm alone goes.
  const wrist = center("wrist_left"), target: Three = [wrist[0] + 40, wrist[1], wrist[2] - 170];
  const from = await project(page, wrist), to = await project(page, target);
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move(to.x, to.y, { steps: 3 });
  const pull = await pulled();
  await picture("pins");
  await page.mouse.up();
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull === null);
  const posed = await frame();
  const slid = Math.max(...vertices(posed, "foot_bones_left").map((vertex, i) => distance(vertex, feet[i]!)));
  assert.ok(slid < 2, `the pinned foot went ${slid} mm`);
  assert.ok(pull.residual < 2, `${pull.residual} mm are left`);
  assert.ok(distance(vertices(posed, "hand_bones_left")[0]!, hand) > 100);
  // Beyond reach where the pelvis stays, but within the window: Chromium tells a page nothing of a mouse beyond it.
  await page.locator("#move-root").uncheck();
  await page.evaluate(() => (window as any).ecorche.posing.poser.resetAll());
  await drawn();
  const beyond: Three = [wrist[0] + 1300, wrist[1], wrist[2] + 200], far = await project(page, beyond), again = await project(page, wrist);
  await page.mouse.move(again.x, again.y);
  await page.mouse.down();
  await page.mouse.move(far.x, far.y, { steps: 3 });
  assert.ok((await pulled()).residual > 20);
  await drawn();
  assert.match((await page.locator(".scene-label[data-kind='short']").textContent())!, /\d+ mm short/);
  await picture("short");
  await page.keyboard.press("Escape");
  await page.mouse.up();
  assert.ok(Math.abs(await angle("shoulder_left")) < 1e-3, "Escape takes it back");
  for (const pin of ["Foot, left", "Foot, right"]) await page.locator(".pins li", { hasText: pin }).locator("button").click();
});

test("the tool pulls the body anywhere, also under a finger", async () => {
  await page.keyboard.press("1");
  await page.keyboard.press("g");
  await drawn();
  const from = await project(page, foremost(await frame(), tissue("tibia_left"))), to = { x: from.x + 50, y: from.y - 60 };
  const touch = await page.context().newCDPSession(page);
  const send = (type: string, at?: { x: number; y: number }) => touch.send("Input.dispatchTouchEvent" as never, { type, touchPoints: at ? [at] : [] } as never);
  await send("touchStart", from);
  for (let i = 1; i <= 6; i++) await send("touchMove", { x: from.x + ((to.x - from.x) * i) / 6, y: from.y + ((to.y - from.y) * i) / 6 });
  const pull = await pulled();
  await send("touchEnd");
  await page.waitForFunction(() => (window as any).ecorche.posing.drag.store.state.pull === null);
  assert.equal(model.skeleton!.segments[pull.segment]!.name, "shank_left");
  assert.ok(Math.abs(await angle("hip_left", 1)) > 2, "the leg went aside with the finger");
  await page.keyboard.press("g");
});

test("fields bring a joint to a place", async () => {
  await choose("wrist_left");
  await page.locator(".places summary").click();
  const up = page.locator("#place-2"), before = Number(await up.inputValue());
  await up.fill(String(before + 150));
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelector("#says")!.textContent === "Reached");
  assert.ok(Math.abs(Number(await up.inputValue()) - before - 150) < 1);
});

test("mirror and reset", async () => {
  await choose("elbow_left");
  await page.locator("#angle-elbow_left-flexion").fill("80");
  await page.keyboard.press("Enter");
  await page.locator(".joint-editor button", { hasText: "To other side" }).click();
  assert.ok(Math.abs((await angle("elbow_right")) - 80) < 1e-6);
  await page.locator(".joint-editor button", { hasText: "As scanned" }).click();
  assert.ok(Math.abs((await angle("elbow_left")) - 17) < 1e-6 && Math.abs((await angle("elbow_right")) - 80) < 1e-6);
  await page.locator("#panel-pose button", { hasText: "Mirror" }).click();
  assert.ok(Math.abs((await angle("elbow_left")) - 80) < 1e-6 && Math.abs((await angle("elbow_right")) - 17) < 1e-6);
});

test("a downloaded pose.yaml is what the program reads, and its file comes back", async () => {
  await page.locator("#tab-library").click();
  await page.locator("[data-pose='sitting']").click();
  await choose("shoulder_right");
  await page.locator("#tab-pose").click();
  await page.locator("#angle-shoulder_right-rotation").fill("-33.3");
  await page.keyboard.press("Enter");
  await page.locator("#tab-library").click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#panel-library button", { hasText: "Download" }).click()]);
  const file = path.join(folder, "pose.yaml"), out = path.join(folder, "posed");
  await download.saveAs(file);
  // The program poses the bones where the server has them.
  execFileSync(process.env["ECORCHE_BIN"]!, ["pose", process.env["ECORCHE_MODEL"]!, "-o", out, "--pose", file, "--tissues", "humerus_right,tibia_left", "--volumes", "none", "--format", "obj"], { stdio: "pipe" });
  const shown = await frame();
  for (const name of ["humerus_right", "tibia_left"]) {
    const theirs = fs.readFileSync(path.join(out, `${name}.obj`), "utf8").split("\n").filter((line) => line.startsWith("v ")).map((line) => line.split(" ").slice(1, 4).map(Number));
    const ours = vertices(shown, name);
    assert.equal(theirs.length, ours.length);
    ours.forEach((vertex, i) => assert.ok(distance(vertex, theirs[i]!) < 0.15, `${name} ${i}: ${vertex} here, ${theirs[i]} there`));
  }
  // Read again by the program, it is the same text: nothing was lost on the way.
  const numbers = (text: string) => [...text.matchAll(/-?\d+(\.\d+)?(e-?\d+)?/g)].map(Number);
  assert.deepEqual(numbers(fs.readFileSync(file, "utf8")), numbers(fs.readFileSync(path.join(out, "pose.yaml"), "utf8")));
  await page.evaluate(() => (window as any).ecorche.posing.poser.resetAll());
  await page.setInputFiles("#pose-file", file);
  await page.waitForFunction(() => document.querySelector("#says")!.textContent === "Opened pose.yaml");
  assert.ok(Math.abs((await angle("shoulder_right", 2)) + 33.3) < 1e-6);
  fs.writeFileSync(file, "ecorche_pose: 1\nskeleton: somebody\n");
  await page.setInputFiles("#pose-file", file);
  await page.waitForFunction(() => /for the skeleton 'somebody'/.test(document.querySelector("#says")!.textContent!));
});

test("saved poses have pictures and come back", async () => {
  await page.locator("#tab-library").click();
  await page.locator("[data-pose='arms_up']").click();
  await frame();
  await page.waitForTimeout(500);
  const raised = await angle("shoulder_left", 1);
  await page.locator("#pose-name").fill("Reaching");
  await page.keyboard.press("Enter");
  const card = page.locator("[data-pose='Reaching']");
  await card.waitFor();
  await page.waitForTimeout(500);
  const colors = await card.locator("canvas").evaluate((canvas: HTMLCanvasElement) => {
    const { data } = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
    return new Set(Array.from({ length: data.length / 4 }, (_, i) => `${data[4 * i]! >> 4},${data[4 * i + 1]! >> 4},${data[4 * i + 2]! >> 4}`)).size;
  });
  assert.ok(colors > 20, `its picture has ${colors} colours`);
  await picture("library");
  await page.evaluate(() => (window as any).ecorche.posing.poser.resetAll());
  await card.click();
  await page.waitForFunction(() => document.querySelector("#says")!.textContent === "Opened Reaching");
  assert.ok(Math.abs((await angle("shoulder_left", 1)) - raised) < 1e-6);
  await page.locator("[aria-label='Delete Reaching']").click({ force: true });
  assert.equal(await card.count(), 0);
});

test("a link restores pose, camera and layers in another page", async () => {
  await page.evaluate(() => {
    const app = (window as any).ecorche, { poser } = app.posing;
    app.layers.setVisible([0], false);
    poser.turn(poser.state.rig.segments.findIndex((s: any) => s.joint.name === "knee_right"), 0, 1);
    app.views.place = { position: [1, 1.2, 2], target: [0, 0.9, 0] };
  });
  const link = await page.evaluate(() => (window as any).ecorche.posing.link());
  assert.ok(!link.includes("token") && !link.includes("session"), link);
  const other = await newPage(browser, site);
  await openBody(other.page, site, new URL(link).hash);
  const seen = await other.page.evaluate(() => {
    const app = (window as any).ecorche, { poser } = app.posing;
    return {
      knee: poser.angle(poser.state.rig.segments.findIndex((s: any) => s.joint.name === "knee_right"), 0), camera: app.views.place,
      skin: app.store.state.layers[0].visible, bone: app.store.state.layers[1].visible,
    };
  });
  assert.ok(Math.abs(seen.knee - 1) < 1e-8);
  assert.ok(distance(seen.camera.position, [1, 1.2, 2]) < 1e-6 && distance(seen.camera.target, [0, 0.9, 0]) < 1e-6);
  assert.deepEqual([seen.skin, seen.bone], [false, true]);
  assert.deepEqual(other.faults, []);
  await other.page.context().close();
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
});

test("nothing went wrong in the page meanwhile", () => assert.deepEqual(viewed.faults, []));
