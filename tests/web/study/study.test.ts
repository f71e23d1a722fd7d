// SPDX-License-Identifier: Apache-2.0
// examples/study in Chromium, from the disk as people get it: every picture once in a random order, answers kept and saved, nothing sent.
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import type { Browser, BrowserContext, Page } from "playwright-core";
import { launch } from "../support/chromium.js";

declare const ROOT: string;
const FOLDER = path.join(ROOT, "examples/study"), PAGE = pathToFileURL(path.join(FOLDER, "index.html")).href;
let browser: Browser;
const faults: string[] = [];

before(async () => {
  browser = await launch();
});
after(() => browser?.close());

async function open(context: BrowserContext): Promise<Page> {
  const page = await context.newPage();
  page.on("console", (message) => { if (message.type() === "error") faults.push(message.text()); });
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => { if (!/^(file|blob):/.test(request.url())) faults.push(`asked for ${request.url()}`); });
  await page.goto(PAGE);
  return page;
}

const shown = (page: Page) => page.locator("#picture").evaluate((image) => (image as HTMLImageElement).src.split("/").pop()!);

async function answer(page: Page, value: number): Promise<void> {
  await page.locator(`input[value="${value}"]`).check();
  await page.locator("#next").click();
}

test("every picture is asked once, and the file says what was answered", async () => {
  const context = await browser.newContext({ acceptDownloads: true }), page = await open(context);
  assert.equal(await page.locator("#count").textContent(), "22");
  await page.locator("#begin").click();
  const seen: string[] = [], given: number[] = [];
  for (let n = 0; n < 22; ++n) {
    assert.equal(await page.locator("#progress").textContent(), `Picture ${n + 1} of 22`);
    assert.ok(await page.locator("#next").isDisabled(), "without an answer there is no next");
    await page.locator("#picture").evaluate((image) => (image as HTMLImageElement).decode());
    seen.push(await shown(page));
    given.push(1 + (5 * n) % 8);
    await answer(page, given[n]!);
  }
  assert.equal(new Set(seen).size, 22);
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save").click()]);
  const lines = fs.readFileSync((await download.path())!, "utf8").trimEnd().split("\n").map((line) => line.split(","));
  assert.deepEqual(lines.shift(), ["person", "order", "pose", "view", "method", "answer"]);
  assert.deepEqual(lines.map((line) => Number(line[5])), given);
  assert.deepEqual(lines.map((line) => Number(line[1])), Array.from({ length: 22 }, (_, n) => n + 1));
  assert.equal(new Set(lines.map((line) => line[0])).size, 1);
  assert.equal(download.suggestedFilename(), `answers_${lines[0]![0]}.csv`);
  const of = (method: string) => lines.filter((line) => line[4] === method).map((line) => `${line[2]} ${line[3]}`).sort();
  assert.equal(of("fem").length, 11);
  assert.deepEqual(of("fem"), of("cor"), "each pose from each view by both methods");
  assert.equal(new Set(lines.map((line) => line[2])).size, 6);
  // What stands in the file is what was seen.
  const of_file = new Map([...fs.readFileSync(path.join(FOLDER, "pictures.js"), "utf8").matchAll(/\{.*\}/g)].map(([text]) => {
    const row = JSON.parse(text) as { file: string; pose: string; view: string; method: string };
    return [path.basename(row.file), `${row.pose},${row.view},${row.method}`];
  }));
  assert.deepEqual(lines.map((line) => line.slice(2, 5).join(",")), seen.map((name) => of_file.get(name)));
  for (const name of seen) assert.match(name, /^\d\d\.png$/, "a name that tells nothing");
  await page.locator("#again").click();
  assert.ok(await page.locator("#begin").isVisible());
  assert.equal(await page.evaluate(() => localStorage.length), 0);
  await context.close();
  assert.deepEqual(faults, []);
});

test("a page that was closed goes on where it was; another person has another order", async () => {
  const orders: string[] = [];
  for (let person = 0; person < 2; ++person) {
    const context = await browser.newContext();
    let page = await open(context);
    await page.locator("#begin").click();
    await answer(page, 3);
    const second = await shown(page), order = await page.evaluate(() => localStorage.getItem("ecorche-study-1"));
    orders.push(JSON.stringify(JSON.parse(order!).order));
    await page.close();
    page = await open(context);
    assert.equal(await page.locator("#progress").textContent(), "Picture 2 of 22");
    assert.equal(await shown(page), second);
    // What is no run of these pictures is not gone on with.
    for (const bad of ["{", "null", '{"person":"a","order":[0,0],"answers":[]}', order!.replace('"answers":[3]', '"answers":[9]')]) {
      await page.evaluate((text) => localStorage.setItem("ecorche-study-1", text), bad);
      await page.reload();
      assert.ok(await page.locator("#begin").isVisible(), bad);
    }
    await context.close();
  }
  assert.notEqual(orders[0], orders[1]);
  assert.deepEqual(faults, []);
});

test("by the keyboard alone", async () => {
  const context = await browser.newContext(), page = await open(context);
  await page.locator("#begin").focus();
  await page.keyboard.press("Enter");
  await page.locator("input[value=\"1\"]").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  assert.equal(await page.locator("#progress").textContent(), "Picture 2 of 22");
  assert.deepEqual(JSON.parse((await page.evaluate(() => localStorage.getItem("ecorche-study-1")))!).answers, [2]);
  await context.close();
  assert.deepEqual(faults, []);
});
