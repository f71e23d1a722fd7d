// SPDX-License-Identifier: Apache-2.0
// One line of JSON for each encoding: whole bodies from `ecorche serve` to a page in Chromium, posed again as soon as a frame is there.
// Run by `run`.
import { Encoding } from "../../clients/web/protocol/src/index.js";
import { bundle, openUntapped, serve } from "../../tests/web/support/pages.js";
import { Server, within } from "../../tests/web/support/server.js";

const [model, seconds] = process.argv.slice(2);
const files = await bundle(["protocol/src/worker.ts", "../../bench/web/stream_page.ts"]);
files["/"] = '<!doctype html><script type="module" src="stream_page.js"></script>';

let hear: (body: string) => void = () => {};
const site = await serve(files, { posted: (body) => hear(body) });
const server = await Server.start(["--origin", site.origin, "--pose-rate", "10000", "--message-rate", "100000"], { model });
try {
  for (const [encoding, normals] of [[Encoding.U16_DELTA, 0], [Encoding.U16_DELTA, 1], [Encoding.U16, 0], [Encoding.F32, 0]]) {
    const said = new Promise<string>((resolve) => { hear = resolve; });
    const end = openUntapped(`${site.origin}/?server=${server.url}&encoding=${encoding}&normals=${normals}&seconds=${seconds}`);
    try {
      console.log(JSON.stringify({ encoding: Encoding[encoding], normals, ...JSON.parse(await within(60 + 3 * Number(seconds), said, "the page")) }));
    } finally {
      await end();
    }
  }
} finally {
  await Promise.all([server.stop(), site.close()]);
}
