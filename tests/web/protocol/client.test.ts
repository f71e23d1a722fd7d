// SPDX-License-Identifier: Apache-2.0
// The typed client against the real server.
import assert from "node:assert/strict";
import { after, before, test, type TestContext } from "node:test";
import { Client, ConnectionError, Encoding, Role, ServerError, type BodyFrame, type MeshStream } from "../../../clients/web/protocol/src/index.js";
import { Server, within } from "../support/server.js";

let server: Server;
before(async () => { server = await Server.start(); });
after(() => server?.stop());

/** Closed with its test: one that stays open keeps node from ending. */
async function connected(t: TestContext): Promise<Client> {
  const client = await within(20, Client.connect(server.url), "connecting");
  t.after(() => client.close());
  return client;
}

const nextFrame = (stream: MeshStream): Promise<BodyFrame> => within(20, new Promise((resolve) => {
  const off = stream.on("frame", (frame) => { off(); resolve(frame); });
}), "a frame");

/** Of a vertex, mm. */
const position = ({ vertices, scale, offset }: BodyFrame, vertex: number) => offset.map((low, axis) => low + scale * vertices[4 * vertex + axis]);

test("opens, shows the rest pose, poses, and says what a joint cannot do", async (t) => {
  const client = await connected(t);
  const states: string[] = [];
  client.on("state", ({ state }) => states.push(state));
  const [first] = await client.listModels();
  const model = await client.open(first.name, "web_client");
  assert.equal(client.control.role, Role.CONTROLLER);

  const stream = await client.subscribeMesh({ encoding: Encoding.U16_DELTA, normals: true });
  const rest = await nextFrame(stream);
  assert.equal(rest.poseSequence, 0n);
  assert.equal(BigInt(rest.layout.vertexCount), model.tissues.reduce((sum, tissue) => sum + tissue.vertices, 0n));
  const before = rest.layout.ranges.map(({ firstVertex }) => position(rest, firstVertex));

  const joints = model.skeleton!.segments, knee = joints.findIndex(({ name }) => name === "shank_right");
  const rotation = joints.flatMap(() => [1, 0, 0, 0]);
  rotation.splice(4 * knee, 4, Math.cos(0.5), 0, Math.sin(0.5), 0);  // not about its axis
  const acknowledged = within(20, new Promise<string[]>((resolve) => {
    client.on("pose", ({ clamped }) => resolve(clamped.map(({ name }) => name)));
  }), "a PoseAck");
  client.setPose({ rotation, rootTranslation: [10, 0, 0] });
  const posed = await nextFrame(stream);
  assert.deepEqual(await acknowledged, ["knee_right"]);
  assert.equal(posed.poseSequence, 1n);
  assert.notEqual(posed.frame, rest.frame);
  posed.layout.ranges.forEach(({ tissue, firstVertex }, i) => {
    if (model.tissues[tissue].name !== "skull") return;
    const now = position(posed, firstVertex);
    [10, 0, 0].forEach((move, axis) => assert.ok(Math.abs(now[axis] - before[i][axis] - move) < 0.2, `${now} from ${before[i]}`));
  });
  client.close();
  assert.deepEqual(states, ["closed"]);
});

test("a refusal is an error with the server's line", async (t) => {
  const client = await connected(t);
  await assert.rejects(client.open("nobody"), (error: ServerError) => error instanceof ServerError && error.code === 5 && /no model of that name/.test(error.message));
});

test("what is no address is told at once", async () => {
  for (const url of ["", "nonsense", "ftp://127.0.0.1/v1"]) {
    await assert.rejects(within(5, Client.connect(url), url), (error) => error instanceof ConnectionError && error.message.startsWith(`'${url}' is no address`));
  }
});

test("a pose that cannot be written is told to who gave it, and the one before goes on", async (t) => {
  const client = await connected(t);
  const model = await client.open();
  const rotation = model.skeleton!.segments.flatMap(() => [1, 0, 0, 0]);
  const taken = within(20, new Promise<bigint>((resolve) => { client.on("pose", ({ sequence }) => resolve(sequence)); }), "a PoseAck");
  client.setPose({ rotation });
  assert.throws(() => client.setPose({ rotation, translation: [{ joint: -1, offset: [0, 0, 0] }] }), /joint/);
  assert.throws(() => client.setPose({ rotation, skinning: 1.5 as number }), /skinning/);
  assert.equal(await taken, 1n);
  assert.equal((await client.probe([0, 0, 0])).poseSequence, 1n);
  assert.equal(client.state.state, "open");
});

test("the session stands in the address, where a balancer looks for it", async (t) => {
  const asked: string[] = [];
  const Real = globalThis.WebSocket;
  globalThis.WebSocket = class extends Real {
    constructor(url: string | URL, protocols?: string | string[]) {
      asked.push(String(url));
      super(url, protocols);
    }
  };
  t.after(() => { globalThis.WebSocket = Real; });
  const client = await within(20, Client.connect(server.url, { session: "ward_3", worker: false }), "connecting");
  t.after(() => client.close());
  assert.deepEqual(asked, [`${server.url}?session=ward_3`]);
  assert.equal((await client.open("", "ward_3")).session, "ward_3");
});
