// SPDX-License-Identifier: Apache-2.0
// Skinning at the client, on the processor: the vertices of the real server in the poses by which it measured, by every method, level and
// part; and a server that lies.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { parse } from "yaml";
import library from "../../../io/case/data/poses.yaml";
import {
  Client, Encoding, MeshArray_Kind, NO_NORMAL, ProtocolError, ScalarType, type Pose, Skinning, STRIDE, SubscribeSchema, type BodyFrame, type MeshStream,
  type SkinningData,
} from "../../../clients/web/protocol/src/index.js";
import { wholeLayout } from "../../../clients/web/protocol/src/layout.js";
import { MeshFeed } from "../../../clients/web/protocol/src/mesh_feed.js";
import { unpackingReady } from "../../../clients/web/protocol/src/layout.js";
import { readSkinning } from "../../../clients/web/protocol/src/skinning/skinning.js";
import { presets, type Library } from "../../../clients/web/viewer/src/posing/presets.js";
import { wireOf } from "../../../clients/web/viewer/src/posing/pose.js";
import { rigOf } from "../../../clients/web/viewer/src/posing/rig.js";
import { Random } from "../support/random.js";
import { Server, within } from "../support/server.js";

let server: Server, client: Client;
before(async () => {
  server = await Server.start();
  client = await within(20, Client.connect(server.url), "connecting");
  await client.open();
});
after(async () => {
  client?.close();
  await server?.stop();
});

async function shows(stream: MeshStream, sequence: bigint): Promise<BodyFrame> {
  return within(60, new Promise<BodyFrame>((resolve) => {
    const look = (frame: BodyFrame) => frame.poseSequence === sequence && (off(), resolve({ ...frame }));
    const off = stream.on("frame", look);
    if (stream.latest) look(stream.latest);
  }), `pose ${sequence}`);
}

/** Poses, and waits until it was taken up. */
async function take(pose: Pose, skinning: Skinning): Promise<bigint> {
  const taken = within(20, new Promise<bigint>((resolve) => { const off = client.on("pose", ({ sequence }) => { off(); resolve(sequence); }); }), "a PoseAck");
  client.setPose({ ...pose, skinning });
  return taken;
}

function normalOf(coded: number): number[] {
  const u = ((coded & 255) - 128) / 127, v = ((coded >> 8) - 128) / 127, z = 1 - Math.abs(u) - Math.abs(v);
  const n = z < 0 ? [(1 - Math.abs(v)) * Math.sign(u || 1), (1 - Math.abs(u)) * Math.sign(v || 1), z] : [u, v, z], length = Math.hypot(...n);
  return n.map((value) => value / length);
}

// Two steps of rounding, each way, and float32.
const ROUNDING_MM = 0.1, NORMAL_ROUNDING = 0.035;

test("in every pose and method that the server measured, no vertex is further off than it says", async (t) => {
  const own = await client.subscribeMesh({ encoding: Encoding.U16, normals: true }), skinned = await client.subscribeMesh({ motions: true });
  const poses = presets(parse(library) as Library, rigOf(client.model!.skeleton!)), { skinning } = skinned;
  assert.ok(skinning);
  assert.deepEqual([...skinning.measured].sort(), [...poses.map(({ name }) => name), "halfway_low", "halfway_high"].sort());
  assert.ok(skinning.largestError > 0 && skinning.largestError <= 0.55, `${skinning.largestError} mm`);
  const hung = skinning.hungNodes.length / 4;
  t.diagnostic(`${skinning.vertexCount} vertices, ${hung} hung on ${skinning.pointCount - skinning.vertexCount} nodes, ${skinning.influences} influences: `
    + `${(skinning.bytes / skinning.vertexCount).toFixed(1)} bytes a vertex, ${skinning.largestError.toFixed(3)} mm, normals ${skinning.usualNormalError.toFixed(3)} and ${skinning.largestNormalError.toFixed(3)}`);
  const worst = { mm: 0, usual: 0 };
  for (const method of [Skinning.COR, Skinning.DQS, Skinning.LBS]) {
    for (const { name, pose } of method === Skinning.COR ? poses : poses.slice(-3)) {
      const sequence = await take(wireOf(pose), method), [theirs, ours] = await Promise.all([shows(own, sequence), shows(skinned, sequence)]);
      assert.deepEqual(ours.offset, theirs.offset, "in the server's own box");
      let largest = 0;
      const turns: number[] = [];
      for (let at = 0; at < theirs.vertices.length; at += STRIDE) {
        largest = Math.max(largest, theirs.scale * Math.hypot(...[0, 1, 2].map((axis) => theirs.vertices[at + axis] - ours.vertices[at + axis])));
        const [a, b] = [theirs.vertices[at + 3], ours.vertices[at + 3]];
        assert.equal(a === NO_NORMAL, b === NO_NORMAL);
        if (a !== NO_NORMAL) turns.push(Math.acos(Math.min(1, normalOf(a).reduce((sum, value, i) => sum + value * normalOf(b)[i], 0))));
      }
      turns.sort((a, b) => a - b);
      const usual = turns[Math.floor(0.99 * turns.length)];
      assert.ok(largest <= skinning.largestError + ROUNDING_MM, `${name}, ${Skinning[method]}: ${largest} mm`);
      assert.ok(usual <= skinning.usualNormalError + NORMAL_ROUNDING, `${name}, ${Skinning[method]}: ${usual} of ${skinning.usualNormalError}`);
      assert.ok(ours.bytes < 0.25 * theirs.bytes, `${ours.bytes} bytes`);
      worst.mm = Math.max(worst.mm, largest);
      worst.usual = Math.max(worst.usual, usual);
    }
  }
  assert.ok(worst.mm > 0.3 * skinning.largestError, `what it states is what is there: ${worst.mm} of ${skinning.largestError} mm`);
  for (const stream of [own, skinned]) await client.closeMesh(stream);
});

test("a level of some tissues is skinned as it comes in frames; what goes far has a box of its own", async () => {
  const tissues = ["skin", "femur_left"].filter((name) => client.model!.tissues.some((tissue) => tissue.name === name));
  const own = await client.subscribeMesh({ encoding: Encoding.F32, tissues, level: 2 }), skinned = await client.subscribeMesh({ motions: true, tissues, level: 2 });
  assert.ok(skinned.skinning!.vertexCount < Number(client.model!.tissues[0].vertices) / 4);
  const sequence = await take({ ...wireOf(presets(parse(library) as Library, rigOf(client.model!.skeleton!))[0].pose), rootTranslation: [9000, 0, 0] }, Skinning.COR);
  const [theirs, ours] = await Promise.all([shows(own, sequence), shows(skinned, sequence)]);
  for (let at = 0; at < theirs.vertices.length; ++at) {
    if (at % STRIDE === 3) continue;
    const axis = at % STRIDE, apart = theirs.offset[axis] + theirs.scale * theirs.vertices[at] - ours.offset[axis] - ours.scale * ours.vertices[at];
    assert.ok(Math.abs(apart) < skinned.skinning!.largestError + ROUNDING_MM, `${apart} mm`);
  }
  for (const stream of [own, skinned]) await client.closeMesh(stream);
});

test("motions are asked for alone", async () => {
  for (const wrong of [{ normals: true }, { encoding: Encoding.U16 }, { adaptive: true }, { controlNodes: true }]) {
    const value = create(SubscribeSchema, { what: { case: "mesh", value: { motions: true, ...wrong } } });
    await assert.rejects(client.ask({ case: "subscribe", value }, "subscribed"), /motions/);
  }
});

test("bytes that are no skinning are refused, whatever they tell of", async () => {
  await unpackingReady;
  const value = create(SubscribeSchema, { what: { case: "mesh", value: { motions: true } } });
  const { value: answer, payload } = await client.ask({ case: "subscribe", value }, "subscribed"), bytes = new Uint8Array(payload);
  const layout = wholeLayout(client.model!.tissues.map(({ name, vertices }) => ({ name, vertexCount: Number(vertices), triangles: new Uint32Array() })), []);
  const segments = client.model!.skeleton!.segments.length, data = answer.skinning!;
  const read = (change: (data: SkinningData) => void, from = bytes) => {
    const lie = structuredClone(data);
    change(lie);
    return readSkinning(lie, from, layout, segments);
  };
  read(() => {});
  const hung = data.tissues.findIndex(({ hungCount }) => hungCount > 0);
  assert.ok(hung >= 0, "the fixture hangs vertices on nodes");
  const lies: [string, (data: SkinningData) => void][] = [
    ["no box", (lie) => { lie.box = undefined; }], ["a step of nothing", (lie) => { lie.box!.step = 0; }], ["a box of no number", (lie) => { lie.box!.lowX = NaN; }],
    ["a tissue too few", (lie) => { lie.tissues.pop(); }], ["another tissue", (lie) => { lie.tissues[1].tissue = 0; }],
    ["other vertices", (lie) => { lie.tissues[0].vertices++; }], ["points without end", (lie) => { lie.tissues[0].pointCount = 4e9; }],
    ["fewer points than vertices", (lie) => { lie.tissues[0].pointCount = 1; }], ["more hung than there are", (lie) => { lie.tissues[0].hungCount = lie.tissues[0].vertices + 1; }],
    ["five influences", (lie) => { lie.tissues[hung].influences = 5; }], ["other influences", (lie) => { lie.tissues[hung].influences = 1; }],
    ["no points", (lie) => { lie.tissues[0].points = undefined; }], ["an array beyond the payload", (lie) => { lie.tissues[0].points!.count += 1n << 40n; }],
    ["points of another type", (lie) => { lie.tissues[0].points!.type = ScalarType.U16; }], ["no hung vertices", (lie) => { lie.tissues[hung].hung = undefined; }],
  ];
  for (const [name, change] of lies) assert.throws(() => read(change), ProtocolError, name);
  assert.throws(() => readSkinning(data, bytes, layout, 2), ProtocolError, "segments that the model has not");
  const array = data.tissues[0].points!;
  for (let bytesLeft = 0; bytesLeft < Number(array.count); bytesLeft += 9973) {
    assert.throws(() => read((lie) => { lie.tissues[0].points!.count = BigInt(bytesLeft); }), ProtocolError, `${bytesLeft} bytes`);
  }
  // What is flipped is refused or harmless: no index leaves its array.
  const random = new Random(5);
  for (let round = 0; round < 40; ++round) {
    const flipped = bytes.slice();
    flipped[random.below(flipped.length)] ^= 1 << random.below(8);
    try {
      const table = read(() => {}, flipped);
      assert.ok(table.hungNodes.every((node) => node >= table.vertexCount && node < table.pointCount));
      for (let at = 0; at < table.weights.length; at += 2) assert.ok(table.weights[at] < segments);
    } catch (error) {
      assert.ok(error instanceof ProtocolError, `${error}`);
    }
  }
  // Frames, too.
  const table = read(() => {});
  const feed = new MeshFeed({ stream: 1, layouts: [layout], topology: 0n, encoding: Encoding.F32, shared: false, skinning: table,
    makeKernel: () => assert.fail("motions need no kernel") }, () => {});
  const rows = new Float64Array(7 * segments);
  for (let s = 0; s < segments; ++s) rows[7 * s] = 1;
  const frame = (count: number, kind = MeshArray_Kind.MOTIONS) => ({
    topologyDigest: 0n, level: 0, encoding: Encoding.F32, skinning: Skinning.COR, frame: 1n, box: data.box, clamped: [],
    arrays: [{ tissue: 0, kind, array: { type: ScalarType.F64, components: 7, count: BigInt(count), offset: 0n } }],
  }) as never;
  const payloadOf = (change: (rows: Float64Array) => void) => { const own = rows.slice(); change(own); return new Uint8Array(own.buffer); };
  feed.show(frame(segments), payloadOf(() => {}));
  assert.throws(() => feed.show(frame(segments - 1), payloadOf(() => {})), ProtocolError);
  assert.throws(() => feed.show(frame(segments + 1), payloadOf(() => {})), ProtocolError);
  assert.throws(() => feed.show(frame(segments, MeshArray_Kind.NODES), payloadOf(() => {})), ProtocolError);
  assert.throws(() => feed.show(frame(segments), payloadOf((own) => { own[3] = 1; })), ProtocolError, "a quaternion of another length");
  assert.throws(() => feed.show(frame(segments), payloadOf((own) => { own[6] = Infinity; })), ProtocolError);
});
