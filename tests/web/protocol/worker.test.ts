// SPDX-License-Identifier: Apache-2.0
// The link in a worker in Chromium, with shared memory and without, gives the vertices that node's gives; its faults are loud.
import assert from "node:assert/strict";
import crypto from "node:crypto";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { Client, Encoding } from "../../../clients/web/protocol/src/index.js";
import { bundle, faultsOf, launch, serve, type Files, type Site } from "../support/pages.js";
import { bendingPose } from "../support/poses.js";
import { Server, within } from "../support/server.js";

const POSES = 12;
interface Shown {
  digest: string;
  shared: boolean;
  isolated: boolean;
  buffers: number;
}
declare const window: { run(poses: number): Promise<Shown>; failed(): Promise<string> };

let browser: Browser, files: Files, isolated: Site, plain: Site, server: Server, expected: string;

before(async () => {
  files = { ...await bundle(["protocol/src/worker.ts", "../../tests/web/protocol/page.ts"]), "/": '<!doctype html><script type="module" src="page.js"></script>' };
  files["/index.html"] = files["/"];
  files["/rejecting.js"] = "setTimeout(() => Promise.reject(new Error('nobody awaits this')), 100);\n" + files["/worker.js"];
  files["/throwing.js"] = "setTimeout(() => { throw new Error('nobody catches this'); }, 100);\n" + files["/worker.js"];
  [isolated, plain] = await Promise.all([serve(files), serve(files, { isolated: false })]);
  [browser, server] = await Promise.all([launch(), Server.start(["--origin", isolated.origin, "--origin", plain.origin])]);
  expected = await reference();
});
after(async () => {
  await browser?.close();
  await Promise.all([isolated?.close(), plain?.close(), server?.stop()]);
});

/** The same poses on node. */
async function reference(): Promise<string> {
  const client = await Client.connect(server.url);
  try {
    const model = await client.open();
    const stream = await client.subscribeMesh({ encoding: Encoding.U16, normals: true });
    client.setPose(bendingPose(model, 0.05 * POSES));
    const vertices = await within(20, new Promise<Uint16Array>((resolve) => {
      stream.on("frame", (frame) => { if (frame.poseSequence === 1n) resolve(frame.vertices); });
    }), "a frame");
    return crypto.createHash("sha256").update(Uint16Array.from(vertices)).digest("hex");
  } finally {
    client.close();
  }
}

async function opened(t: { after(end: () => Promise<void>): void }, site: Site, worker: string | undefined): Promise<[Page, string[]]> {
  const page = await browser.newPage(), faults = faultsOf(page);
  t.after(() => page.close());
  await page.goto(`${site.origin}/index.html?server=${server.url}${worker ? `&worker=${worker}` : ""}`);
  return [page, faults];
}

for (const [name, site, worker, shared, most] of [
  ["in a worker, by shared memory", () => isolated, "/worker.js", true, 1],
  ["in a worker, by buffers to and fro", () => plain, "/worker.js", false, POSES + 1],
  ["without a worker", () => isolated, undefined, true, 1],
  ["without a worker and shared memory", () => plain, undefined, false, 2],
] as const) {
  test(name, async (t) => {
    const [page, faults] = await opened(t, site(), worker);
    const shown = await within(90, page.evaluate((poses) => window.run(poses), POSES), "the page");
    assert.deepEqual(faults, []);
    assert.equal(shown.digest, expected);
    assert.deepEqual([shown.shared, shown.isolated], [shared, site() === isolated]);
    assert.ok(shown.buffers <= most, `${shown.buffers} buffers`);
  });
}

for (const [name, worker, fault] of [
  ["a promise that is rejected in the worker", "/rejecting.js", /nobody awaits this/],
  ["a worker that throws", "/throwing.js", /nobody catches this/],
  ["a worker that does not start", "/nothing.js", /nothing\.js does not start/],
] as const) {
  test(`${name} fails the page`, async (t) => {
    const [page] = await opened(t, isolated, worker);
    assert.match(await within(60, page.evaluate(() => window.failed()), "an error of the page"), fault);
  });
}
