// SPDX-License-Identifier: Apache-2.0
// The page: what it loads, whom it asks, how it looks on a phone and to a screen reader, what it saves, and what it says when the server
// is away or wants a token.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import axe from "axe-core";
import type { Browser, Download, Page } from "playwright-core";
import { Client, type BodyFrame } from "../../../clients/web/protocol/src/index.js";
import { launch, newPage, openBody, scratch, Site, VIEWER } from "../support/page.js";
import { place } from "../support/picture.js";
import { Server, within } from "../support/server.js";

const FIRST_LOAD_KB = 300;
let server: Server, site: Site, browser: Browser;

before(async () => {
  server = await Server.start();
  site = await Site.start(() => server.httpPort);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  site?.stop();
  await server?.stop();
});

/** Findings of axe that are serious or worse. */
async function serious(page: Page): Promise<string[]> {
  await page.evaluate(axe.source);
  const { violations } = await page.evaluate(() => (window as any).axe.run(document, { resultTypes: ["violations"] })) as axe.AxeResults;
  return violations.filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html} (${failureSummary})`).join("; ")}`);
}

test("loads little, from nowhere else, and breaks no rule of its policy", async () => {
  const { page, faults, files } = await newPage(browser, site);
  await openBody(page, site);
  const sizes = [...files].map((name) => [name, fs.statSync(path.join(VIEWER, `${name}.gz`)).size] as const);
  const total = sizes.reduce((sum, [, size]) => sum + size, 0) / 1000;
  assert.ok(sizes.some(([name, size]) => /main-.*\.js/.test(name) && size > 10_000), `the scripts are not counted: ${[...files]}`);
  assert.ok(total <= FIRST_LOAD_KB, `${total.toFixed(1)} kB gzipped at first load, at most ${FIRST_LOAD_KB}: ${sizes.join(" ")}`);

  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    await page.waitForSelector(`html[data-theme=${scheme}]`, { state: "attached" });
    assert.deepEqual(await serious(page), []);
  }
  // Under colours of one's own, what is chosen has theirs.
  await page.emulateMedia({ colorScheme: "light", forcedColors: "active" });
  const [chosen, theirs] = await page.evaluate(() => {
    const pressed = document.querySelector<HTMLElement>('[aria-pressed="true"]')!, swatch = pressed.appendChild(document.createElement("i"));
    swatch.style.cssText = "forced-color-adjust: none; background: Highlight";
    const colors = [pressed, swatch].map((one) => getComputedStyle(one).backgroundColor);
    swatch.remove();
    return colors;
  });
  assert.equal(chosen, theirs);
  await page.emulateMedia({ forcedColors: "none" });
  await page.click("#canvas", { position: { x: 10, y: 10 } });
  await page.keyboard.press("?");
  await page.waitForSelector("dialog[open]");
  assert.match((await page.textContent("dialog[open]"))!, /See through the skin/);
  assert.deepEqual(await serious(page), []);
  await page.click("dialog >> text=Licences");
  await page.waitForSelector("dialog[open] .licence");
  const licences = (await page.textContent("dialog[open]"))!;
  for (const name of ["three", "@bufbuild/protobuf"]) assert.ok(licences.includes(name), `the licences leave out ${name}`);
  await page.keyboard.press("Escape");
  await page.click(".verdict");
  assert.match((await page.textContent(".figures"))!, /Change of volume/);
  assert.deepEqual(await serious(page), []);
  assert.deepEqual(faults, []);
  await page.context().close();
});

test("the keyboard alone chooses, hides and turns", async () => {
  const { page, faults } = await newPage(browser, site);
  await openBody(page, site);
  await page.keyboard.press("/");
  await page.keyboard.type("skull");
  for (const key of ["ArrowDown", "ArrowDown", "Enter"]) await page.keyboard.press(key);
  assert.equal(await page.textContent(".chosen h2"), "Skull");
  await page.keyboard.press(" ");
  assert.equal(await page.textContent(".chosen button:has-text('Show')"), "Show");
  await page.keyboard.press("Control+z");
  await page.focus("#canvas");
  const before = await page.evaluate(() => (window as any).ecorche.views.place.position);
  await page.keyboard.press("ArrowRight");
  const turned = await page.evaluate(() => (window as any).ecorche.views.place.position);
  assert.ok(Math.hypot(...before.map((value: number, i: number) => value - turned[i])) > 0.1, `${before} and ${turned}`);
  await page.keyboard.press("1");
  const front = await page.evaluate(() => (window as any).ecorche.views.place);
  assert.ok(Math.abs(front.position[0] - front.target[0]) < 1e-6 && front.position[2] > front.target[2]);
  await page.keyboard.press("Tab");
  const outline = await page.evaluate(() => getComputedStyle(document.activeElement!).outlineStyle);
  assert.equal(outline, "solid", "the focus is not seen");
  assert.deepEqual(faults, []);
  await page.context().close();
});

test("fits a phone, and a finger", async () => {
  const { page, faults } = await newPage(browser, site, { viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });
  await openBody(page, site);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
  for (const part of ["#tools", ".verdict", ".readout", "#tab-tissues", "#purpose"]) {
    const box = (await page.locator(part).boundingBox())!;
    assert.ok(box.x >= 0 && box.x + box.width <= 390 && box.y >= 0 && box.y + box.height <= 780, `${part} is cut: ${JSON.stringify(box)}`);
  }
  await page.tap("#tab-tissues");
  await page.tap(".tree li:has-text('Bones') .name");
  await page.tap(".tree li[data-row='5'] .name");
  await page.waitForSelector(".chosen h2");
  assert.deepEqual(await serious(page), []);
  // The body is fitted into what the sheet leaves.
  const lowest = await page.evaluate(() => {
    const { body, stage } = (window as any).ecorche, box = body.bounds();
    const foot = box.min.clone().setY((box.min.y + box.max.y) / 2).applyMatrix4(stage.patient.matrix).project(stage.camera);
    return (0.5 - foot.y / 2) * innerHeight;
  });
  const sheet = (await page.locator(".dock[data-dock=sheet]").boundingBox())!;
  assert.ok(lowest < sheet.y, `the feet are at ${lowest}, the sheet begins at ${sheet.y}`);
  assert.deepEqual(faults, []);
  await page.context().close();
});

test("saves the picture, and the posed tissues as GLB and STL", async () => {
  const { page, faults } = await newPage(browser, site);
  await openBody(page, site);
  const client = await Client.connect(server.url);
  const model = await client.open(), stream = await client.subscribeMesh();
  const frame = stream.latest ?? await within(30, new Promise<BodyFrame>((resolve) => { stream.on("frame", resolve); }), "a frame");
  client.close();
  const row = model.tissues.findIndex(({ name }) => name === "skull"), range = frame.layout.ranges.find(({ tissue }) => tissue === row)!;
  const skull = Array.from({ length: range.vertexCount }, (_, i) => place(frame, range.firstVertex + i));
  const low = [0, 1, 2].map((axis) => Math.min(...skull.map((point) => point[axis]))), high = [0, 1, 2].map((axis) => Math.max(...skull.map((point) => point[axis])));
  await page.evaluate((each) => (window as any).ecorche.layers.isolate([each]), row);

  const folder = scratch();
  const saved = async (entry: string): Promise<Buffer> => {
    const coming = page.waitForEvent("download");
    await page.click("#tools button[aria-label^=Save]");
    await page.click(`.menu >> text=${entry}`);
    const download: Download = await coming, file = path.join(folder, download.suggestedFilename());
    await download.saveAs(file);
    return fs.readFileSync(file);
  };
  const png = await saved("Picture");
  assert.equal(png.subarray(1, 4).toString(), "PNG");
  assert.deepEqual([png.readUInt32BE(16), png.readUInt32BE(20)], [900, 640]);

  const glb = await saved("colours");
  assert.equal(glb.toString("latin1", 0, 4), "glTF");
  const json = JSON.parse(glb.toString("utf8", 20, 20 + glb.readUInt32LE(12)));
  assert.deepEqual(json.nodes.filter((node: { mesh?: number }) => node.mesh !== undefined).map((node: { name: string }) => node.name), ["skull"]);
  const positions = json.accessors[json.meshes[0].primitives[0].attributes.POSITION];
  const expected = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]].map((corner) => corner.map((value) => value / 1000));
  [positions.min, positions.max].forEach((corner, which) => corner.forEach((value: number, axis: number) =>
    assert.ok(Math.abs(value - expected[which][axis]) < 1e-4, `${corner}, expected ${expected[which]}`)));

  const stl = await saved("print");
  assert.equal(stl.readUInt32LE(80), range.indexCount / 3);
  const least = [0, 1, 2].map((axis) => {
    let value = Infinity;
    for (let at = 84; at < stl.length; at += 50) for (let corner = 1; corner <= 3; ++corner) value = Math.min(value, stl.readFloatLE(at + 12 * corner + 4 * axis));
    return value;
  });
  least.forEach((value, axis) => assert.ok(Math.abs(value - low[axis]) < 0.01, `${least}, expected ${low}`));
  assert.deepEqual(faults, []);
  await page.context().close();
});

test("comes back by itself after the server was gone", async () => {
  const { page, faults } = await newPage(browser, site);
  await openBody(page, site);
  const stopped = server;
  await stopped.stop("SIGKILL");
  await page.waitForSelector("#banner:not([hidden])");
  assert.match((await page.textContent("#banner"))!, /Trying again/);
  assert.ok(await page.evaluate(() => (window as any).ecorche.body.bounds().isEmpty()) === false, "the last picture is gone");
  server = await Server.start();
  await page.waitForSelector("#banner", { state: "hidden" });
  await page.waitForFunction(() => (window as any).ecorche.store.state.link.state === "open");
  const before = await page.evaluate(() => (window as any).ecorche.live.stream.generation);
  await page.evaluate(() => {
    const { client } = (window as any).ecorche.live;
    client.setPose({ rotation: client.model.skeleton.segments.flatMap(() => [1, 0, 0, 0]), rootTranslation: [50, 0, 0] });
  });
  await page.waitForFunction((count) => (window as any).ecorche.live.stream.generation > count, before);
  // The line was refused while the server was away: that alone the browser says by itself.
  assert.deepEqual(faults.filter((fault) => !/WebSocket connection to .* failed/.test(fault)), []);
  await page.context().close();
});

test("takes the token out of the address, and says what to do without one", async () => {
  const file = path.join(scratch(), "token");
  fs.writeFileSync(file, "sesame-of-this-test\n");
  const guarded = await Server.start(["--token-file", file]);
  const there = await Site.start(() => guarded.httpPort);
  try {
    const { page } = await newPage(browser, there);
    await page.goto(`${there.origin}/#token=wrong`);
    await page.waitForSelector("#cover .card[role=alert]");
    assert.match((await page.textContent("#cover"))!, /another token\. Open the whole address that `ecorche serve` printed/);
    await page.goto("about:blank");
    await openBody(page, there, "#token=sesame-of-this-test&session=told");
    assert.equal(new URL(page.url()).hash, "#session=told");
    assert.equal(await page.evaluate(() => (window as any).ecorche.store.state.model.session), "told");
    await page.reload();
    await page.waitForFunction(() => performance.getEntriesByName("ecorche body").length > 0);
    await page.context().close();
  } finally {
    there.stop();
    await guarded.stop();
  }
});

test("waits for a server that is not there yet", async () => {
  let port = 1;
  const there = await Site.start(() => port);
  try {
    const { page } = await newPage(browser, there);
    await page.goto(there.origin);
    await page.waitForFunction(() => document.querySelector("#cover")!.textContent!.includes("Waiting for the server"));
    assert.match((await page.textContent("#cover"))!, /Is `ecorche serve` running/);
    port = server.httpPort;
    await page.waitForFunction(() => performance.getEntriesByName("ecorche body").length > 0);
    assert.equal(await page.isHidden("#cover"), true);
    await page.context().close();
  } finally {
    there.stop();
  }
});
