// SPDX-License-Identifier: Apache-2.0
// The page of stream.ts: asks for the next pose as soon as a frame is there, for so many seconds, and posts what came of it.
import { Client, Encoding } from "../../clients/web/protocol/src/index.js";
import { bendingPose } from "../../tests/web/support/poses.js";

const wanted = new URLSearchParams(location.search);
const number = (name: string) => Number(wanted.get(name));

async function measure(): Promise<object> {
  const client = await Client.connect(wanted.get("server")!, { worker: "/worker.js" });
  const model = await client.open();
  const stream = await client.subscribeMesh({ encoding: number("encoding") as Encoding, normals: number("normals") === 1 });
  let frames = 0, bytes = 0, decodeMs = 0, start = 0, sent = 0;
  const delays: number[] = [], warm = 20;
  const pose = () => {
    sent = performance.now();
    client.setPose(bendingPose(model, 0.3 * Math.sin(frames / 10)));
  };
  return new Promise((resolve) => {
    stream.on("frame", (frame) => {
      const now = performance.now();
      if (++frames === warm) [start, bytes, decodeMs] = [now, 0, 0];
      bytes += frame.bytes;
      decodeMs += frame.decodeMs;
      if (frames > warm) delays.push(now - sent);
      if (frames <= warm || now - start < 1000 * number("seconds")) return pose();
      client.close();
      const seconds = (now - start) / 1000, counted = frames - warm;
      delays.sort((a, b) => a - b);
      resolve({
        vertices: frame.layout.vertexCount, rate: counted / seconds, megabytes: bytes / seconds / 1e6, decodeMs: decodeMs / counted,
        p50: delays[delays.length >> 1], p99: delays[Math.floor(0.99 * delays.length)], shared: crossOriginIsolated,
      });
    });
    if (stream.latest) pose();
  });
}

measure().catch((error: unknown) => ({ error: String(error) })).then((body) => fetch("/", { method: "POST", body: JSON.stringify(body) }));
