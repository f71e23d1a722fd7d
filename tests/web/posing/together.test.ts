// SPDX-License-Identifier: Apache-2.0
// Two pages in one session: who looks on sees the pose and cannot change it; control is asked for, given and taken. And clips: played,
// paused, sought, stepped, recorded and played again.
import assert from "node:assert/strict";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { launch, newPage, openBody, scratch, Site, type Viewed } from "../support/page.js";
import { Server } from "../support/server.js";

const CLIPS = path.join(path.dirname(process.env["ECORCHE_MODEL"]!), "small/motion");
const SMALL = { viewport: { width: 780, height: 420 } };
let server: Server, site: Site, browser: Browser, first: Viewed, second: Viewed;

before(async () => {
  server = await Server.start(["--clips", CLIPS, "--record-dir", scratch()]);
  site = await Site.start(() => server.httpPort);
  browser = await launch();
  [first, second] = [await newPage(browser, site, SMALL), await newPage(browser, site, SMALL)];
  for (const [viewed, name] of [[first, "Ann"], [second, "Bo"]] as const) {
    await viewed.page.addInitScript((own) => localStorage.setItem("ecorche.name", own), name);
    await openBody(viewed.page, site, "#session=together");
    // A bone alone: software GL is slow.
    await viewed.page.evaluate(() => (window as any).ecorche.layers.isolate([1]));
  }
});
after(async () => {
  await browser?.close();
  site?.stop();
  await server?.stop();
});

const knee = (page: Page): Promise<number> => page.evaluate(() => {
  const { poser } = (window as any).ecorche.posing;
  return poser.angle(poser.state.rig.segments.findIndex((s: any) => s.joint.name === "knee_left"), 0);
});
const bend = (page: Page, radians: number) => page.evaluate((value) => {
  const { poser } = (window as any).ecorche.posing;
  return poser.turn(poser.state.rig.segments.findIndex((s: any) => s.joint.name === "knee_left"), 0, value);
}, radians);
/** Asked again and again from outside: within the page its policy allows no text to be run. */
async function until(page: Page, what: string): Promise<void> {
  for (const end = Date.now() + 30_000; !(await page.evaluate(what)); await page.waitForTimeout(30)) assert.ok(Date.now() < end, `30 s without ${what}`);
}
const kneeIs = (page: Page, radians: number) => page.waitForFunction((value) => {
  const { poser } = (window as any).ecorche.posing;
  return Math.abs(poser.angle(poser.state.rig.segments.findIndex((s: any) => s.joint.name === "knee_left"), 0) - value) < 1e-6;
}, radians, { timeout: 30_000 });
const strip = (page: Page) => page.locator("#panel-pose .control-strip");
const open = (page: Page, panel: string) => page.evaluate((id) => (window as any).ecorche.panels.open(id), panel);
const clip = "ecorche.posing.clips.store.state";

test("who looks on sees the pose in fields and picture, and cannot change it", async () => {
  for (const { page } of [first, second]) await open(page, "pose");
  await bend(first.page, 0.7);
  await kneeIs(second.page, 0.7);
  await second.page.evaluate(() => (window as any).ecorche.posing.poser.select(10));
  assert.ok(await second.page.locator("#angle-knee_left-flexion").isDisabled());
  assert.equal(await second.page.locator("#angle-knee_left-flexion").inputValue(), "40.1");
  assert.equal(await bend(second.page, 0.2), null);
  assert.match((await second.page.locator("#says").textContent())!, /take control to pose/);
  await until(second.page, "document.querySelector('#panel-pose .control-strip').textContent.includes('Ann poses')");
});

test("control is asked for and given, and its new holder goes on from the present pose", async () => {
  await strip(second.page).locator("button", { hasText: "Ask for control" }).click();
  await until(second.page, "document.querySelector('#panel-pose .control-strip').textContent.includes('Asked Ann')");
  await until(first.page, "document.querySelector('#panel-pose .control-strip').textContent.includes('Bo asks to pose')");
  await open(first.page, "people");
  assert.equal(await first.page.locator(".people li").count(), 2);
  if (process.env["ECORCHE_PICTURES"]) await first.page.screenshot({ path: path.join(process.env["ECORCHE_PICTURES"], "people.png") });
  await first.page.locator(".people button", { hasText: "Give" }).click();
  await until(second.page, "ecorche.posing.poser.state.controls");
  await until(first.page, "!ecorche.posing.poser.state.controls");
  assert.ok(Math.abs((await knee(second.page)) - 0.7) < 1e-6);
  await second.page.evaluate(() => (window as any).ecorche.posing.poser.turn(9, 0, 0.5));
  await first.page.waitForFunction(() => Math.abs((window as any).ecorche.posing.poser.angle(9, 0) - 0.5) < 1e-6);
  assert.ok(Math.abs((await knee(first.page)) - 0.7) < 1e-6, "the knee stayed");
});

test("control that is given up is free to take", async () => {
  await open(second.page, "people");
  await second.page.locator("#panel-people button", { hasText: "Give control up" }).click();
  await open(first.page, "pose");
  await strip(first.page).locator("button", { hasText: "Take control" }).click();
  await until(first.page, "ecorche.posing.poser.state.controls");
  await bend(first.page, 0.3);
  await kneeIs(second.page, 0.3);
});

test("a clip is played, paused, sought and stepped, and the joints go along", async () => {
  const { page } = first;
  await open(page, "clips");
  await page.locator("[data-clip='bend']").click();
  await until(page, `${clip}.now?.playing`);
  await page.locator("#panel-clips .player [aria-label='Pause']").click();
  await until(page, `${clip}.now && !${clip}.now.playing`);
  await page.evaluate(() => (window as any).ecorche.posing.clips.seek(1));
  await until(page, `Math.abs(${clip}.now.position - 1) < 0.02`);
  await page.waitForTimeout(500);
  const asked = await page.evaluate(() => (window as any).ecorche.posing.poser.state.asked.rotation);
  await second.page.waitForFunction((rotation) => (window as any).ecorche.posing.poser.state.asked.rotation.flat()
    .every((x: number, i: number) => Math.abs(x - (rotation as number[][]).flat()[i]!) < 1e-9), asked, { timeout: 30_000 });
  const before = await page.evaluate(`${clip}.now.position`) as number, rate = await page.evaluate(`${clip}.now.framesPerSecond`) as number;
  await page.locator("#panel-clips .player [aria-label='One pose on']").click();
  await until(page, `Math.abs(${clip}.now.position - ${before + 1 / rate}) < 1e-3`);
  if (process.env["ECORCHE_PICTURES"]) await page.screenshot({ path: path.join(process.env["ECORCHE_PICTURES"], "clips.png") });
  // A pose of one's own ends the clip, and goes on from where it stood.
  const hip = await page.evaluate(() => (window as any).ecorche.posing.poser.angle(1, 0));
  assert.ok(Math.abs(hip) > 0.01, "the trunk is bent");
  await bend(page, 0.2);
  await until(page, `${clip}.now === null`);
  assert.ok(Math.abs((await page.evaluate(() => (window as any).ecorche.posing.poser.angle(1, 0))) - hip) < 1e-6);
});

test("a session is recorded and played again", async () => {
  const { page } = first;
  await page.locator("#record-name").fill("knee_bend");
  await page.locator(".record button").click();
  await until(page, `${clip}.recording === 'knee_bend'`);
  for (let i = 0; i <= 5; i++) {
    await bend(page, 0.2 * i);
    await page.waitForTimeout(150);
  }
  await page.locator(".record button").click();
  await page.locator("[data-clip='knee_bend']").waitFor();
  await bend(page, 0);
  await page.locator("[data-clip='knee_bend']").click();
  await until(page, `${clip}.now && !${clip}.now.playing`);
  await kneeIs(page, 1);
});

test("nothing went wrong in the pages meanwhile", () => assert.deepEqual([...first.faults, ...second.faults], []));
