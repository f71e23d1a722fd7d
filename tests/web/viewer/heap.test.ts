// SPDX-License-Identifier: Apache-2.0
// The page's memory while a clip plays: flat over ten minutes, or ECORCHE_HEAP_SECONDS.
import assert from "node:assert/strict";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client } from "../../../clients/web/protocol/src/index.js";
import { launch, newPage, openBody, Site, type Viewed } from "../support/page.js";
import { Server } from "../support/server.js";

const SECONDS = Number(process.env["ECORCHE_HEAP_SECONDS"] ?? 600);
const EVERY = Math.min(30, SECONDS / 10);
/** Until all has been made that is made once: other levels of detail, code that gets compiled. */
const WARM = Math.min(60, SECONDS / 3);
const MOST_GROWTH = 1 << 20;
let server: Server, site: Site, browser: Browser, viewed: Viewed, client: Client;

before(async () => {
  server = await Server.start(["--clips", path.join(process.env["ECORCHE_CASE"]!, "motion")]);
  site = await Site.start(() => server.httpPort);
  client = await Client.connect(server.url);
  await client.open("", "viewer_heap");
  browser = await launch();
  viewed = await newPage(browser, site);
  await openBody(viewed.page, site, "#session=viewer_heap");
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});

test(`the heap of a page that shows a clip is flat over ${SECONDS} s`, { timeout: 1000 * (SECONDS + 300) }, async () => {
  const { page } = viewed, devtools = await page.context().newCDPSession(page);
  const [clip] = await client.listClips();
  await client.playClip(clip!.name, { loop: true });
  const used = async () => {
    // Twice: what the first finds may let go of more.
    for (let turn = 0; turn < 2; ++turn) await devtools.send("HeapProfiler.collectGarbage");
    const { usedSize, backingStorageSize = 0 } = await devtools.send("Runtime.getHeapUsage") as { usedSize: number; backingStorageSize?: number };
    return usedSize + backingStorageSize;
  };
  const sleep = (seconds: number) => new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
  const pose = () => page.evaluate(() => Number((window as any).ecorche.store.state.poseSequence));
  await sleep(WARM);
  const first = await pose(), start = performance.now(), samples: [number, number][] = [];
  do {
    samples.push([(performance.now() - start) / 1000, await used()]);
    await sleep(EVERY);
  } while (performance.now() - start < 1000 * SECONDS);
  assert.ok(await pose() > first + SECONDS, "the clip does not play");
  // The line through them by least squares.
  const mean = (at: 0 | 1) => samples.reduce((sum, sample) => sum + sample[at], 0) / samples.length, middle = mean(0), level = mean(1);
  const slope = samples.reduce((sum, [time, bytes]) => sum + (time - middle) * (bytes - level), 0) / samples.reduce((sum, [time]) => sum + (time - middle) ** 2, 0);
  const said = `${samples.map(([time, bytes]) => `${Math.round(time)} s ${(bytes / 2 ** 20).toFixed(2)}`).join(", ")} MiB: ${(slope * 60 / 1024).toFixed(1)} KiB a minute`;
  console.log(said);
  assert.ok(slope * SECONDS < MOST_GROWTH, `it grows: ${said}`);
  assert.deepEqual(viewed.faults, []);
});
