// SPDX-License-Identifier: Apache-2.0
// The panel of the balls in Chromium: what is picked there, hung elsewhere, undone and saved is what the server has.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { launch, newPage, openBody, scratch, Site, type Viewed } from "../support/page.js";
import { Server } from "../support/server.js";

const folder = scratch(), MODEL = path.join(folder, "balls.hdf");
let server: Server, site: Site, browser: Browser, viewed: Viewed, client: Client, model: ModelOpened;

before(async () => {
  execFileSync(process.env["ECORCHE_BIN"]!, ["preprocess", process.env["ECORCHE_CASE"]!, "-o", MODEL, "--max-tets", "20000", "--spheres", "0.48"], { stdio: "pipe" });
  server = await Server.start([], { model: MODEL });
  site = await Site.start(() => server.httpPort);
  browser = await launch();
  viewed = await newPage(browser, site);
  await openBody(viewed.page, site, "#session=balls");  // the first one there controls the session
  client = await Client.connect(server.url);
  model = await client.open("", "balls");
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});

const segment = (name: string) => model.skeleton!.segments.findIndex((each) => each.name === name);
const counts = () => viewed.page.locator("#panel-balls [role=status]").textContent();
const button = (name: string) => viewed.page.locator("#panel-balls").getByRole("button", { name, exact: true });
const on = async (row: number) => (await client.spheres("ct")).segment.filter((each) => each === row).length;

/** The server has so many balls on the segment. */
async function until(row: number, wanted: number): Promise<void> {
  for (const end = performance.now() + 20_000; await on(row) !== wanted;) {
    assert.ok(performance.now() < end, `${await on(row)} balls on ${model.skeleton!.segments[row]!.name}, expected ${wanted}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

test("balls come, and are picked by a box and by a click", async () => {
  const { page } = viewed;
  await page.click("#tab-balls");
  await button("Show the balls").click();
  const all = (await client.spheres("ct")).segment.length;
  await page.waitForFunction((text) => document.querySelector("#panel-balls [role=status]")?.textContent === text, `0 of ${all} balls picked`);
  if (process.env["ECORCHE_PICTURES"]) await page.screenshot({ path: path.join(process.env["ECORCHE_PICTURES"], "balls_panel.png") });
  const { left, top, width, height } = await page.evaluate(() => (window as any).ecorche.stage.free as { left: number; top: number; width: number; height: number });
  await button("Box").click();
  await page.mouse.move(left + 2, top + 2);
  await page.mouse.down();
  await page.mouse.move(left + width - 2, top + height - 2, { steps: 4 });
  await page.mouse.up();
  assert.equal(await counts(), `${all} of ${all} balls picked`);
  await button("Pick none").click();
  await button("One ball").click();
  // Some pixel of the trunk has a ball.
  for (let at = 0; at < 12 && (await counts())!.startsWith("0 "); at++) await page.mouse.click(left + width / 2 + 3 * at, top + height * 0.4);
  assert.equal(await counts(), `1 of ${all} balls picked`);
  await button("One ball").click();
});

test("those of a hand are hung on the forearm at the server, and come back when it is undone", async () => {
  const { page } = viewed, hand = segment("hand_left"), forearm = segment("forearm_left");
  const [hands, forearms] = [await on(hand), await on(forearm)];
  assert.ok(hands > 0 && forearms > 0);
  await page.selectOption("#balls-segment", String(hand));
  await button("Pick none").click();
  await button("Pick all of it").click();
  assert.ok((await counts())!.startsWith(`${hands} of `));
  await page.selectOption("#balls-segment", String(forearm));
  await button("Hang on it").click();
  await until(hand, 0);
  await until(forearm, hands + forearms);
  const saving = page.waitForEvent("download");
  await button("Save as .vtp").click();
  const text = fs.readFileSync(await (await saving).path(), "utf8");
  assert.match(text, /^<\?xml|^<VTKFile/);
  assert.match(text, /Name="ecorche_volumetric_skeleton"/);
  await page.evaluate(() => (window as any).ecorche.history.undo());
  await until(hand, hands);
  await until(forearm, forearms);
});

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));
