// SPDX-License-Identifier: Apache-2.0
// The page of worker.test.ts: shows what came to it as `window.shown`, and takes orders from the test.
import { Client, Encoding, type BodyFrame, type MeshStream } from "../../../clients/web/protocol/src/index.js";
import { bendingPose } from "../support/poses.js";

const wanted = new URLSearchParams(location.search);
const digest = async (vertices: Uint16Array): Promise<string> => {
  const hash = await crypto.subtle.digest("SHA-256", Uint16Array.from(vertices));
  return [...new Uint8Array(hash)].map((byte) => byte.toString(16).padStart(2, "0")).join("");
};

async function start() {
  const client = await Client.connect(wanted.get("server")!, { worker: wanted.get("worker") ?? false });
  const model = await client.open("", wanted.get("session") ?? "");
  const stream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA, normals: true });
  return { client, model, stream };
}

const frameOf = (stream: MeshStream, sequence: bigint): Promise<BodyFrame> => new Promise((resolve) => {
  if (stream.latest?.poseSequence === sequence) return resolve(stream.latest);
  const off = stream.on("frame", (frame) => {
    if (frame.poseSequence === sequence) { off(); resolve(frame); }
  });
});

/** The first uncaught error of the page itself: those of a worker do not come here by themselves. */
const failed = new Promise<string>((resolve) => addEventListener("error", ({ message }) => resolve(message)));
const started = start();
started.catch(() => {});  // what failed is told by `failed`
Object.assign(window, {
  failed: () => failed,
  /** Poses one after another; what the vertices of the last one hash to, and what they lie in. */
  async run(poses: number) {
    const { client, model, stream } = await started;
    const buffers = new Set<ArrayBufferLike>();
    stream.on("frame", ({ vertices }) => buffers.add(vertices.buffer));
    let frame = await frameOf(stream, 0n);
    for (let i = 1; i <= poses; ++i) {
      client.setPose(bendingPose(model, 0.05 * i));
      frame = await frameOf(stream, BigInt(i));
    }
    return {
      digest: await digest(frame.vertices), shared: !(frame.vertices.buffer instanceof ArrayBuffer), isolated: crossOriginIsolated,
      buffers: buffers.size, decodeMs: frame.decodeMs,
    };
  },
});
