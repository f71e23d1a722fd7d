// SPDX-License-Identifier: Apache-2.0
// Every encoding and level of the real server: deltas give the numbers that the server's own u16 frames have, bit for bit, and those lie
// within half a step of its float32.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { Client, Encoding, NO_NORMAL, STRIDE, type BodyFrame, type MeshStream } from "../../../clients/web/protocol/src/index.js";
import { bendingPose } from "../support/poses.js";
import { Server, within } from "../support/server.js";

let server: Server, client: Client, deltas = 0;
before(async () => {
  server = await Server.start();
  client = await within(20, Client.connect(server.url), "connecting");
  await client.open();
});
after(async () => {
  client?.close();
  await server?.stop();
});

/** The frames of these streams for the same pose, copied. */
async function framesOf(streams: MeshStream[], sequence: bigint): Promise<BodyFrame[]> {
  return within(60, Promise.all(streams.map((stream) => new Promise<BodyFrame>((resolve) => {
    const look = (frame: BodyFrame) => {
      if (frame.poseSequence !== sequence) return;
      off();
      resolve({ ...frame, vertices: frame.vertices.slice() });
    };
    const off = stream.on("frame", look);
    if (stream.latest) look(stream.latest);
  }))), `pose ${sequence}`);
}

for (const level of [0, 1, 2, 3]) {
  test(`level ${level}`, async () => {
    const encodings = [Encoding.U16, Encoding.U16_DELTA, Encoding.F32];
    const streams = await Promise.all(encodings.map((encoding) => client.subscribeMesh({ encoding, level, normals: true })));
    const bare = await client.subscribeMesh({ encoding: Encoding.U16_DELTA, level });
    for (let i = 0; i < 4; ++i) {
      const acknowledged = within(20, new Promise<bigint>((resolve) => {
        const off = client.on("pose", ({ sequence }) => { off(); resolve(sequence); });
      }), "a PoseAck");
      client.setPose(bendingPose(client.model!, 0.2 * (i + 1)));
      const [numbers, delta, floats, plain] = await framesOf([...streams, bare], await acknowledged);
      assert.deepEqual([numbers, delta, floats].map(({ encoding }) => encoding), encodings);
      deltas += Number(delta.bytes < numbers.bytes);
      assert.deepEqual(delta.vertices, numbers.vertices);
      assert.deepEqual([delta.scale, delta.offset], [numbers.scale, numbers.offset]);
      const { vertexCount, ranges, indices } = numbers.layout;
      assert.equal(numbers.vertices.length, STRIDE * vertexCount);
      assert.equal(ranges.reduce((sum, range) => sum + range.vertexCount, 0), vertexCount);
      assert.equal(ranges.reduce((sum, range) => sum + range.indexCount, 0), indices.length);
      let unturned = 0;
      for (let v = 0; v < vertexCount; ++v) {
        for (let axis = 0; axis < 3; ++axis) {
          const at = STRIDE * v + axis;
          const byNumber = numbers.offset[axis] + numbers.scale * numbers.vertices[at];
          const byFloat = floats.offset[axis] + floats.scale * floats.vertices[at];
          assert.ok(Math.abs(byNumber - byFloat) < 0.501 * (numbers.scale + floats.scale) + 1e-3, `vertex ${v}: ${byNumber}, ${byFloat}`);
          assert.equal(plain.vertices[at], numbers.vertices[at]);
        }
        assert.equal(floats.vertices[STRIDE * v + 3], numbers.vertices[STRIDE * v + 3]);
        assert.equal(plain.vertices[STRIDE * v + 3], NO_NORMAL);
        unturned += Number(numbers.vertices[STRIDE * v + 3] === NO_NORMAL);
      }
      assert.ok(unturned < vertexCount / 2);
    }
    for (const stream of [...streams, bare]) await client.closeMesh(stream);
  });
}

// A session's keyframes come when they must: no level alone is sure to have had deltas.
test("deltas were among them", () => assert.ok(deltas >= 3, `${deltas}`));
