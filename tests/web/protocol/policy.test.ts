// SPDX-License-Identifier: Apache-2.0
// What a client asks for by what arrives: on paper, and applied to a stream of the real server.
import assert from "node:assert/strict";
import { test } from "node:test";
import { adapt, Client, Encoding, LinePolicy, Policy, type AdaptedOptions, type Choice, type LineSeen, type Observed } from "../../../clients/web/protocol/src/index.js";
import { bendingPose } from "../support/poses.js";
import { Server, within } from "../support/server.js";

const quick: Observed = { framesPerSecond: 60, bytesPerSecond: 20e6, latencyMs: 2, decodeMs: 2, drawMs: 3 };
const see = (policy: Policy, observed: Observed, seconds: number) => { for (let i = 0; i < seconds; ++i) policy.observe(observed); };

test("who keeps up gets everything, as deltas", () => {
  const policy = new Policy();
  see(policy, quick, 60);
  for (const moving of [true, false]) assert.deepEqual(policy.choice(moving), { level: 0, encoding: Encoding.U16_DELTA, maxRate: 0 });
});

test("a slow device gets coarser levels while the body moves, all of it at rest, and finer ones once there is room", () => {
  const policy = new Policy();
  see(policy, { ...quick, drawMs: 50 }, 1);
  assert.equal(policy.choice(true).level, 0, "one slow second");
  see(policy, { ...quick, drawMs: 50 }, 1);
  assert.equal(policy.choice(true).level, 1);
  assert.equal(policy.choice(false).level, 0);
  see(policy, { ...quick, drawMs: 10 }, 30);
  assert.equal(policy.choice(true).level, 1, "a finer level would take four times 12 ms");
  see(policy, { ...quick, drawMs: 1 }, 3);
  assert.equal(policy.choice(true).level, 0);
});

test("ten times too slow skips levels, and the coarsest is the last", () => {
  const policy = new Policy();
  see(policy, { ...quick, drawMs: 500 }, 2);
  assert.equal(policy.choice(true).level, 2);
  see(policy, { ...quick, drawMs: 500 }, 20);
  assert.equal(policy.choice(true).level, 3);
});

test("a finer level that was too much is tried again later and later", () => {
  const policy = new Policy(), waits: number[] = [];
  for (let round = 0; round < 4; ++round) {
    for (let i = 0; i < 30 && policy.choice(true).level === 0; ++i) see(policy, { ...quick, drawMs: 60 }, 1);
    let waited = 0;
    for (; waited < 60 && policy.choice(true).level === 1; ++waited) see(policy, { ...quick, decodeMs: 1, drawMs: 1 }, 1);
    waits.push(waited);
  }
  assert.deepEqual(waits, [2, 4, 8, 16]);
});

test("slow decoding beside a fast line asks for plain numbers, and goes back where the line grows long", () => {
  const policy = new Policy();
  see(policy, { ...quick, decodeMs: 20, latencyMs: 40 }, 5);
  assert.equal(policy.choice(true).encoding, Encoding.U16_DELTA, "a long line");
  see(policy, { ...quick, decodeMs: 20, bytesPerSecond: 150e6 }, 5);
  assert.equal(policy.choice(true).encoding, Encoding.U16_DELTA, "three times as many bytes would not pass");
  see(policy, { ...quick, decodeMs: 20 }, 1);
  assert.equal(policy.choice(true).encoding, Encoding.U16);
  see(policy, { ...quick, latencyMs: 30 }, 1);
  assert.equal(policy.choice(true).encoding, Encoding.U16_DELTA);
});

test("frames that cannot be drawn are not asked for", () => {
  const policy = new Policy();
  see(policy, { ...quick, framesPerSecond: 50, drawMs: 23 }, 1);
  assert.equal(policy.choice(true).maxRate, 32);
  see(policy, { ...quick, framesPerSecond: 32, drawMs: 18 }, 5);
  assert.equal(policy.choice(true).maxRate, 32, "between busy and idle nothing changes");
  see(policy, { ...quick, framesPerSecond: 32, drawMs: 3 }, 1);
  assert.equal(policy.choice(true).maxRate, 0);
  see(policy, { ...quick, framesPerSecond: 0, drawMs: 1000 }, 9);
  assert.deepEqual(policy.choice(true), { level: 0, encoding: Encoding.U16_DELTA, maxRate: 0 }, "no frame tells nothing");
});

const crowded: LineSeen = { framesPerSecond: 4, posesPerSecond: 25, bytesPerSecond: 100e3, latencyMs: 400, coarserBy: 0, busyMs: 0 };
const watch = (line: LinePolicy, seen: LineSeen, seconds: number) => { for (let i = 0; i < seconds; ++i) line.observe(seen); };

test("a slow line makes the client skin, of the level that comes soon, and finer ones while it rests", () => {
  for (const [bytesPerSecond, level] of [[100e6, 0], [2e6, 1], [700e3, 2], [1e3, 3]]) {
    const line = new LinePolicy(1_000_000, true);
    watch(line, { ...crowded, bytesPerSecond }, 1);
    assert.equal(line.skins, undefined, "one slow second");
    watch(line, { ...crowded, bytesPerSecond }, 1);
    assert.equal(line.skins, level);
    for (let i = 0; i < 5; ++i) line.rest();
    assert.equal(line.skins, 0);
  }
});

test("what only looks like a slow line changes nothing", () => {
  const others: Partial<LineSeen>[] = [{ latencyMs: 100 }, { latencyMs: NaN }, { framesPerSecond: 24 }, { posesPerSecond: 4 }, { busyMs: 200 }];
  for (const other of others) {
    const line = new LinePolicy(1000, true);
    watch(line, { ...crowded, ...other }, 30);
    assert.equal(line.skins, undefined, JSON.stringify(other));
  }
  const line = new LinePolicy(1000, false);
  watch(line, crowded, 30);
  assert.equal(line.skins, undefined, "an older server");
  const coarse = new LinePolicy(1000, true);
  watch(coarse, { ...crowded, framesPerSecond: 25, coarserBy: 2 }, 2);
  assert.equal(coarse.skins, 0, "coarser levels alone are a reason");
});

test("a stream follows: whole though it began coarse, coarse in motion, whole at rest", async (t) => {
  const server = await Server.start();
  t.after(() => server.stop());
  const client = await within(20, Client.connect(server.url), "connecting");
  t.after(() => client.close());
  const model = await client.open();
  const stream = await client.subscribeMesh({ level: 2 });  // not `adaptive`: then the server would choose, too
  const choices: Choice[] = [], policy = new Policy();
  const adaptation = adapt(client, stream, (choice) => choices.push(choice), { policy });
  const shows = (level: number) => within(20, new Promise<void>((resolve) => {
    const off = stream.on("frame", (frame) => { if (frame.level === level) { off(); resolve(); } });
  }), `level ${level}`);
  await shows(0);
  adaptation.drawn(200);
  let angle = 0;
  const moving = setInterval(() => client.setPose(bendingPose(model, angle += 0.01)), 40);
  t.after(() => clearInterval(moving));
  t.after(() => adaptation.stop());
  await shows(1);
  assert.equal(stream.options.level, 1);
  clearInterval(moving);
  await shows(0);
  assert.equal(stream.latest!.vertices.length, 4 * stream.latest!.layout.vertexCount);
  assert.equal(stream.options.level, 0);
  assert.ok(choices.some(({ level }) => level === 1));
});

test("what is skinned here has its table once, whatever the device bears", async (t) => {
  class Restless extends Policy {
    override choice(): Choice {
      const odd = Math.floor(performance.now() / 400) % 2 === 1;
      return { level: odd ? 1 : 0, encoding: odd ? Encoding.U16 : Encoding.U16_DELTA, maxRate: odd ? 5 : 0 };
    }
  }
  const server = await Server.start();
  t.after(() => server.stop());
  const client = await within(20, Client.connect(server.url), "connecting");
  t.after(() => client.close());
  const model = await client.open();
  const stream = await client.subscribeMesh();
  const choices: AdaptedOptions[] = [];
  const adaptation = adapt(client, stream, (choice) => choices.push(choice), { policy: new Restless() });
  t.after(() => adaptation.stop());
  let angle = 0;
  const moving = setInterval(() => client.setPose(bendingPose(model, angle += 0.01)), 40);
  t.after(() => clearInterval(moving));
  await within(20, (async () => { while (choices.length < 3) await new Promise((resolve) => setTimeout(resolve, 50)); })(), "a policy that changes its mind");
  await adaptation.hold({ motions: true });
  const before = choices.length;
  assert.equal(choices[before - 1].motions, true);
  await new Promise((resolve) => setTimeout(resolve, 3000));
  assert.equal(choices.length, before);
  assert.equal(stream.options.maxRate, 0);
});
