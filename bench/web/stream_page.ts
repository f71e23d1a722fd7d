// SPDX-License-Identifier: Apache-2.0
// The page of stream.ts: keeps so many poses on their way for so many seconds, gives every frame to WebGL where asked to, and posts what
// came of it.
import { Client, Encoding, type BodyFrame, type ModelOpened } from "../../clients/web/protocol/src/index.js";
import { bendingPose } from "../../tests/web/support/poses.js";

const wanted = new URLSearchParams(location.search);
const number = (name: string) => Number(wanted.get(name));

/** Gives a frame's vertices to WebGL as they came. */
function uploader(): (frame: BodyFrame) => void {
  const gl = document.querySelector("canvas")!.getContext("webgl2")!;
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  let size = 0;
  return ({ vertices }) => {
    if (size !== vertices.byteLength) gl.bufferData(gl.ARRAY_BUFFER, size = vertices.byteLength, gl.DYNAMIC_DRAW);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, vertices);
    gl.flush();
    if (gl.getError() !== gl.NO_ERROR) throw new Error("WebGL refused a frame");
  };
}

/** Tissues that have so many vertices together, or a little less. */
function tissuesOf(model: ModelOpened, vertices: number): string[] {
  const names: string[] = [];
  for (const tissue of [...model.tissues].sort((a, b) => Number(b.vertices - a.vertices))) {
    if (tissue.vertices > vertices) continue;
    names.push(tissue.name);
    vertices -= Number(tissue.vertices);
  }
  return names;
}

/** Messages of a server that does nothing else, as many on their way. */
function measureFloor(): Promise<object> {
  const worker = new Worker(`/floor_worker.js${location.search}`, { type: "module" });
  const sent: number[] = [], delays: number[] = [], warm = 20;
  let frames = 0, bytes = 0, start = 0;
  const ask = () => {
    sent.push(performance.now());
    worker.postMessage(null);
  };
  return new Promise((resolve, reject) => {
    worker.onerror = ({ message }) => reject(new Error(message));
    worker.onmessage = ({ data }: MessageEvent<ArrayBuffer | null>) => {
      // Connected.
      if (!data) return Array.from({ length: number("ahead") }).forEach(ask);
      const now = performance.now();
      if (++frames === warm) [start, bytes, delays.length] = [now, 0, 0];
      bytes += data.byteLength;
      delays.push(now - sent.shift()!);
      if (frames <= warm || now - start < 1000 * number("seconds")) return ask();
      worker.terminate();
      const seconds = (now - start) / 1000;
      resolve({ rate: (frames - warm) / seconds, megabytes: bytes / seconds / 1e6, ...quantiles(delays) });
    };
  });
}

function quantiles(delays: number[]): { p50: number; p99: number } {
  delays.sort((a, b) => a - b);
  return { p50: delays[delays.length >> 1]!, p99: delays[Math.floor(0.99 * delays.length)]! };
}

async function measure(): Promise<object> {
  const client = await Client.connect(wanted.get("server")!, { worker: "/worker.js" });
  const model = await client.open();
  const stream = await client.subscribeMesh({ encoding: number("encoding") as Encoding, normals: number("normals") === 1, level: number("level"),
    tissues: number("vertices") ? tissuesOf(model, number("vertices")) : [] });
  const upload = number("upload") === 1 ? uploader() : undefined;
  let frames = 0, bytes = 0, decodeMs = 0, serverMs = 0, start = 0, sent = model.lastSequence;
  const at = new Map<bigint, number>(), delays: number[] = [], warm = 20;
  const pose = (shown: bigint) => {
    while (sent - shown < BigInt(number("ahead"))) {
      at.set(++sent, performance.now());
      client.setPose(bendingPose(model, 0.3 * Math.sin(Number(sent) / 10)));
    }
  };
  return new Promise((resolve) => {
    stream.on("frame", (frame) => {
      upload?.(frame);
      const now = performance.now(), { poseSequence } = frame;
      if (++frames === warm) [start, bytes, decodeMs, serverMs] = [now, 0, 0, 0];
      bytes += frame.bytes;
      decodeMs += frame.decodeMs;
      serverMs += Number((frame.timings?.posed ?? 0n) + (frame.timings?.encoded ?? 0n)) / 1000;
      if (frames > warm && at.has(poseSequence)) delays.push(now - at.get(poseSequence)!);
      for (const sequence of at.keys()) if (sequence <= poseSequence) at.delete(sequence);
      if (frames <= warm || now - start < 1000 * number("seconds")) return pose(poseSequence);
      client.close();
      const seconds = (now - start) / 1000, counted = frames - warm;
      resolve({
        vertices: frame.layout.vertexCount, rate: counted / seconds, megabytes: bytes / seconds / 1e6, decodeMs: decodeMs / counted, serverMs: serverMs / counted,
        ...quantiles(delays), shared: crossOriginIsolated,
      });
    });
    if (stream.latest) pose(stream.latest.poseSequence);
  });
}

(number("floor") ? measureFloor() : measure()).catch((error: unknown) => ({ error: String(error) })).then((body) => fetch("/", { method: "POST", body: JSON.stringify(body) }));
