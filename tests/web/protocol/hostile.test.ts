// SPDX-License-Identifier: Apache-2.0
// A server that lies: what is no frame of the subscription is refused by a ProtocolError, before there is room for it, and a client that
// is sent such bytes says so and dials again.
import assert from "node:assert/strict";
import type { AddressInfo } from "node:net";
import { test } from "node:test";
import { create, toBinary } from "@bufbuild/protobuf";
import { MeshoptEncoder } from "meshoptimizer/encoder";
import { WebSocketServer } from "ws";
import type { ToClient } from "../../../clients/web/protocol/src/channel.js";
import { makePlainKernel } from "../../../clients/web/protocol/src/decode/kernel.js";
import { encodeFrame } from "../../../clients/web/protocol/src/framing.js";
import { EnvelopeSchema } from "../../../clients/web/protocol/src/gen/ecorche/v1/envelope_pb.js";
import {
  Client, ConnectionError, Encoding, MeshArray_Kind, MeshFrameSchema, MeshLevelSchema, ModelOpenedSchema, ProtocolError, ScalarType, type MeshFrame,
} from "../../../clients/web/protocol/src/index.js";
import { levelLayout, unpackingReady, wholeLayout, wholeTissues, type MeshLayout } from "../../../clients/web/protocol/src/layout.js";
import { MeshFeed } from "../../../clients/web/protocol/src/mesh_feed.js";
import { Random } from "../support/random.js";
import { within } from "../support/server.js";

const VERTICES = 40, TOPOLOGY = 7n;
const range = (tissue: number, vertexCount: number) => ({ tissue, firstVertex: tissue * VERTICES, vertexCount, firstIndex: 0, indexCount: 0 });
const layout = (vertexCount = VERTICES): MeshLayout => (
  { level: 0, vertexCount: 2 * vertexCount, indices: new Uint32Array(), ranges: [range(0, vertexCount), range(1, vertexCount)] });
const array = (type: ScalarType, components: number, count: number, offset: number) =>
  ({ $typeName: "ecorche.v1.Array" as const, type, components, count: BigInt(count), offset: BigInt(offset) });

/** A keyframe of both tissues, and its payload. */
function keyframe(): [MeshFrame, Uint8Array<ArrayBuffer>] {
  const arrays = [0, 1].map((tissue) => ({ tissue, kind: MeshArray_Kind.POSITIONS, array: array(ScalarType.U16, 3, VERTICES, 240 * tissue) }));
  const frame = create(MeshFrameSchema, {
    frame: 5n, keyframe: 5n, topologyDigest: TOPOLOGY, encoding: Encoding.U16_DELTA, arrays, box: { lowX: 0, lowY: 0, lowZ: 0, step: 0.1 },
  });
  return [frame, new Uint8Array(new Random(9).words(240).buffer as ArrayBuffer)];
}

function feedOf(layouts = [layout()]): { feed: MeshFeed; notes: ToClient[]; made: () => number } {
  const notes: ToClient[] = [];
  let made = 0;
  const feed = new MeshFeed({
    stream: 1, layouts, topology: TOPOLOGY, encoding: Encoding.U16_DELTA, shared: false,
    makeKernel: (options) => { ++made; return makePlainKernel(options); },
  }, (note) => notes.push(note));
  return { feed, notes, made: () => made };
}

test("a true keyframe is taken", () => {
  const { feed, notes } = feedOf(), [frame, payload] = keyframe();
  feed.show(frame, payload);
  assert.deepEqual(notes.map(({ kind }) => kind), ["frame"]);
});

const lies: [string, (frame: MeshFrame) => void][] = [
  ["another topology", (frame) => { frame.topologyDigest = 8n; }],
  ["a level that was not asked for", (frame) => { frame.level = 1; }],
  ["an unknown encoding", (frame) => { frame.encoding = 9 as Encoding; }],
  ["no box", (frame) => { frame.box = undefined; }],
  ["a step of nothing", (frame) => { frame.box!.step = 0; }],
  ["a step that is no number", (frame) => { frame.box!.step = NaN; }],
  ["a box that is no number", (frame) => { frame.box!.lowY = NaN; }],
  ["a tissue left out", (frame) => { frame.arrays.pop(); }],
  ["a tissue twice", (frame) => { frame.arrays[1].tissue = 0; }],
  ["no arrays", (frame) => { frame.arrays = []; }],
  ["too few rows", (frame) => { frame.arrays[1].array!.count = 39n; }],
  ["too many rows", (frame) => { frame.arrays[0].array!.count = 41n; }],
  ["more rows than there are bytes", (frame) => { frame.arrays[1].array!.count = 1n << 60n; }],
  ["rows beyond the payload", (frame) => { frame.arrays[1].array!.offset = 256n; }],
  ["an offset between", (frame) => { frame.arrays[1].array!.offset = 8n; }],
  ["another type", (frame) => { frame.arrays[0].array!.type = ScalarType.U8; }],
  ["no array", (frame) => { frame.arrays[0].array = undefined; }],
  ["deltas without their keyframe", (frame) => { frame.keyframe = 4n; }],
  ["normals of one tissue alone", (frame) => {
    frame.arrays.push({ $typeName: "ecorche.v1.MeshArray", tissue: 0, kind: MeshArray_Kind.NORMALS, array: array(ScalarType.I8, 2, VERTICES, 0) });
  }],
];
for (const [name, lie] of lies) {
  test(`refused: ${name}`, () => {
    const { feed, notes, made } = feedOf(), [frame, payload] = keyframe();
    lie(frame);
    assert.throws(() => feed.show(frame, payload), ProtocolError);
    assert.equal(notes.length, 0);
    assert.equal(made(), 0, "room was made");
  });
}

test("floats that are no numbers are refused", () => {
  const { feed } = feedOf(), [frame] = keyframe(), payload = new Uint8Array(960), floats = new Float32Array(payload.buffer);
  frame.encoding = Encoding.F32;
  frame.arrays.forEach(({ array: rows }, i) => { rows!.type = ScalarType.F32; rows!.offset = BigInt(480 * i); });
  feed.show(frame, payload);
  for (const value of [NaN, Infinity, -Infinity]) {
    floats[239] = value;
    assert.throws(() => feed.show(frame, payload), ProtocolError);
  }
});

test("a few bytes that tell of many vertices make no room", () => {
  const huge = layout(1 << 30), { feed, made } = feedOf([huge]), [frame, payload] = keyframe();
  assert.throws(() => feed.show(frame, payload), ProtocolError);
  frame.keyframe = 4n;  // deltas, a few bytes of which may stand for many vertices
  assert.throws(() => feed.show(frame, payload), ProtocolError);
  assert.equal(made(), 0);
});

test("layouts that point beyond their vertices are refused", () => {
  const payload = new Uint8Array(64), words = new Uint32Array(payload.buffer);
  words.set([0, 1, 2, 3, 0, 1, 2, 2, 3, 0]);  // four rows; two triangles of them at 16
  const triangles = array(ScalarType.U32, 3, 2, 16);
  const model = create(ModelOpenedSchema, { tissues: [{ name: "skin", vertices: 4n, triangles }] });
  const tissues = wholeTissues(model, payload);
  assert.deepEqual([...wholeLayout(tissues, []).indices], [0, 1, 2, 2, 3, 0]);
  const level = create(MeshLevelSchema, { level: 1, parts: [{ tissue: 0, vertices: array(ScalarType.U32, 1, 4, 0), triangles }] });
  assert.equal(levelLayout(level, payload, tissues).vertexCount, 4);
  words[9] = 4;
  assert.throws(() => wholeLayout(wholeTissues(model, payload), []), ProtocolError);
  assert.throws(() => levelLayout(level, payload, tissues), ProtocolError);
  words[9] = 0;
  words[3] = 4;
  assert.throws(() => levelLayout(level, payload, tissues), ProtocolError);
  words[3] = 3;
  level.parts[0].tissue = 1;
  assert.throws(() => levelLayout(level, payload, tissues), ProtocolError);
  model.tissues[0].vertices = 1n << 40n;
  assert.throws(() => wholeTissues(model, payload), ProtocolError);
  model.tissues[0].vertices = 4n;
  model.tissues[0].triangles = undefined;
  assert.throws(() => wholeTissues(model, payload), ProtocolError);
});

test("packed triangles that are none are refused", async () => {
  await Promise.all([unpackingReady, MeshoptEncoder.ready]);
  const triangles = Uint32Array.from([0, 1, 2, 2, 1, 3, 4, 6, 5, 4, 5, 0]);
  const good = [...MeshoptEncoder.encodeIndexBuffer(new Uint8Array(triangles.buffer), triangles.length, 4)];
  const opened = (bytes: number[], triangleCount: bigint, vertices = 4n) => {
    const payload = new Uint8Array(64);
    payload.set(bytes);
    const model = create(ModelOpenedSchema, { tissues: [{ name: "skin", vertices, packedTriangles: array(ScalarType.U8, 1, bytes.length, 0), triangleCount }] });
    return wholeLayout(wholeTissues(model, payload), []).indices;
  };
  const corners = [...opened(good, 4n, 7n)], sorted = (rows: number[]) => [0, 3, 6, 9].map((at) => rows.slice(at, at + 3).sort().join());
  assert.deepEqual(sorted(corners), sorted([...triangles]));
  assert.throws(() => opened(good, 4n, 2n), ProtocolError);
  assert.throws(() => opened(good, 1n << 60n), ProtocolError);
  assert.throws(() => opened(good, BigInt(good.length)), ProtocolError);
  assert.throws(() => opened([], 1n), ProtocolError);
  for (let length = 0; length < good.length; ++length) assert.throws(() => opened(good.slice(0, length), 4n, 7n), ProtocolError, `${length} bytes`);
  const random = new Random(3);
  for (let round = 0; round < 2000; ++round) {
    const bytes = good.slice();
    bytes[random.words(1)[0]! % bytes.length]! ^= 1 << (round % 8);
    try {
      // What still unpacks names no vertex that is not there.
      for (const row of opened(bytes, 4n, 7n)) assert.ok(row < 7);
    } catch (error) {
      assert.ok(error instanceof ProtocolError, String(error));
    }
  }
});

test("a client that is sent nonsense says so and dials again", async (t) => {
  const random = new Random(10);
  const hello = encodeFrame(toBinary(EnvelopeSchema, create(EnvelopeSchema, { requestId: 2n, message: { case: "serverHello", value: { protocol: 1 } } })));
  const nonsense: (Uint8Array | string)[] = [
    "words", new Uint8Array(3), Uint8Array.from(random.words(64)), hello.slice(0, 12), encodeFrame(Uint8Array.from([0xff, 0xff, 0xff, 0xff])),
  ];
  for (const bytes of nonsense) {
    const server = new WebSocketServer({ port: 0, host: "127.0.0.1" });
    await new Promise((resolve) => server.once("listening", resolve));
    let dialled = 0;
    server.on("connection", (socket) => {
      ++dialled;
      socket.once("message", () => {
        socket.send(hello);
        if (dialled === 1) setTimeout(() => socket.send(bytes), 50);
      });
    });
    t.after(() => { for (const socket of server.clients) socket.terminate(); server.close(); });
    const states: string[] = [];
    const client = await within(20, Client.connect(`ws://127.0.0.1:${(server.address() as AddressInfo).port}/v1`), "connecting");
    t.after(() => client.close());
    client.on("state", ({ state, reason }) => states.push(`${state} ${reason}`));
    const pending = client.listModels();
    await assert.rejects(within(20, pending, "a refusal"), ConnectionError);
    assert.match(states[0], /^reconnecting \w/);
    client.close();
  }
});

test("a server of another protocol is told apart, and not asked again", async (t) => {
  const server = new WebSocketServer({ port: 0, host: "127.0.0.1" });
  await new Promise((resolve) => server.once("listening", resolve));
  t.after(() => { for (const socket of server.clients) socket.terminate(); server.close(); });
  let dialled = 0;
  server.on("connection", (socket) => {
    ++dialled;
    socket.once("message", () => socket.send(encodeFrame(toBinary(EnvelopeSchema, create(EnvelopeSchema, {
      requestId: 2n, message: { case: "serverHello", value: { protocol: 99 } } })))));
  });
  await assert.rejects(within(20, Client.connect(`ws://127.0.0.1:${(server.address() as AddressInfo).port}/v1`), "connecting"),
    (error: ConnectionError) => error instanceof ConnectionError && error.message === "the server speaks protocol 99, this client 1");
  await new Promise((resolve) => setTimeout(resolve, 300));
  assert.equal(dialled, 1);
});
