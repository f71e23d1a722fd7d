// SPDX-License-Identifier: Apache-2.0
// One line of JSON for each way to stream: bodies from `ecorche serve` to a page in Chromium, posed again as soon as a frame is there, or
// with another pose on its way meanwhile. Run by `run`.
import { Encoding } from "../../clients/web/protocol/src/index.js";
import { bundle, openUntapped, serve } from "../../tests/web/support/pages.js";
import { Server, within } from "../../tests/web/support/server.js";

const [model, seconds] = process.argv.slice(2);
const files = await bundle(["protocol/src/worker.ts", "../../bench/web/stream_page.ts"]);
files["/"] = '<!doctype html><canvas width="256" height="256"></canvas><script type="module" src="stream_page.js"></script>';

const ways = [
  {}, { ahead: 4 }, { normals: 1 }, { normals: 1, ahead: 4 }, { encoding: Encoding.U16 }, { encoding: Encoding.U16, ahead: 4 }, { encoding: Encoding.F32 },
  ...[1, 2, 3].map((level) => ({ level, ahead: 4, upload: 1 })), { vertices: 100_000, upload: 1 }, { vertices: 100_000, ahead: 4, upload: 1 },
];

let hear: (body: string) => void = () => {};
const site = await serve(files, { posted: (body) => hear(body) });
const server = await Server.start(["--origin", site.origin, "--pose-rate", "10000", "--message-rate", "100000"], { model });
try {
  for (const { encoding = Encoding.U16_DELTA, normals = 0, level = 0, ahead = 1, upload = 0, vertices = 0 } of ways) {
    const said = new Promise<string>((resolve) => { hear = resolve; });
    const end = openUntapped(`${site.origin}/?server=${server.url}&encoding=${encoding}&normals=${normals}&level=${level}&ahead=${ahead}&upload=${upload}&vertices=${vertices}&seconds=${seconds}`);
    try {
      console.log(JSON.stringify({ encoding: Encoding[encoding], normals, level, ahead, upload, ...JSON.parse(await within(60 + 3 * Number(seconds), said, "the page")) }));
    } finally {
      await end();
    }
  }
} finally {
  await Promise.all([server.stop(), site.close()]);
}
