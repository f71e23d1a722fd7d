// SPDX-License-Identifier: Apache-2.0
// One line of JSON for each way to stream: bodies from `ecorche serve` to a page in Chromium, posed again as soon as a frame is there, or
// with another pose on its way meanwhile; and, as their floor, messages of the same size that nobody poses, encodes or decodes. Run by `run`.
import { WebSocketServer } from "ws";
import { Encoding } from "../../clients/web/protocol/src/index.js";
import { bundle, openUntapped, serve } from "../../tests/web/support/pages.js";
import { Server, within } from "../../tests/web/support/server.js";

const [model, seconds] = process.argv.slice(2);
const files = await bundle(["protocol/src/worker.ts", "../../bench/web/stream_page.ts", "../../bench/web/floor_worker.ts"]);
files["/"] = '<!doctype html><canvas width="256" height="256"></canvas><script type="module" src="stream_page.js"></script>';

const ways = [
  {}, { floor: 1 }, { ahead: 4 }, { ahead: 4, floor: 1 }, { normals: 1 }, { normals: 1, ahead: 4 }, { encoding: Encoding.U16 }, { encoding: Encoding.U16, ahead: 4 }, { encoding: Encoding.F32 },
  ...[1, 2, 3].map((level) => ({ level, ahead: 4, upload: 1 })), { vertices: 100_000, upload: 1 }, { vertices: 100_000, ahead: 4, upload: 1 },
];

/** Answers every message with as many bytes as the last frames had. */
let bytes = 0;
const bare = new WebSocketServer({ host: "127.0.0.1", port: 0, perMessageDeflate: false });
bare.on("connection", (socket) => {
  const answer = Buffer.alloc(bytes, 0x5a);
  socket.on("message", () => socket.send(answer));
});
await new Promise((resolve) => bare.once("listening", resolve));
const bareUrl = `ws://127.0.0.1:${(bare.address() as { port: number }).port}`;

let hear: (body: string) => void = () => {};
const site = await serve(files, { posted: (body) => hear(body) });
const server = await Server.start(["--origin", site.origin, "--pose-rate", "10000", "--message-rate", "100000"], { model });
try {
  for (const { encoding = Encoding.U16_DELTA, normals = 0, level = 0, ahead = 1, upload = 0, vertices = 0, floor = 0 } of ways) {
    const said = new Promise<string>((resolve) => { hear = resolve; });
    const end = openUntapped(`${site.origin}/?server=${floor ? bareUrl : server.url}&floor=${floor}&encoding=${encoding}&normals=${normals}&level=${level}&ahead=${ahead}&upload=${upload}&vertices=${vertices}&seconds=${seconds}`);
    try {
      const row = JSON.parse(await within(60 + 3 * Number(seconds), said, "the page"));
      if (!floor) bytes = Math.round((1e6 * row.megabytes) / row.rate);
      console.log(JSON.stringify({ encoding: Encoding[encoding], normals, level, ahead, upload, floor, ...row }));
    } finally {
      await end();
    }
  }
} finally {
  bare.close();
  await Promise.all([server.stop(), site.close()]);
}
