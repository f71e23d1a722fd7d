// SPDX-License-Identifier: Apache-2.0
// Volumes as a real server streams them, decoded: every way holds the same voxels. Then the same frames cut short, flipped and lying.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { Client, Deformer, ProtocolError, ScalarType, SubscribeSchema, VolumeDecoder, type ModelOpened, type VolumeFrame, type VolumeImage } from "../../../clients/web/protocol/src/index.js";
import { inflate } from "../../../clients/web/protocol/src/volume/zstd.js";
import { Random } from "../support/random.js";
import { Server, within } from "../support/server.js";

interface Came {
  frame: VolumeFrame;
  payload: Uint8Array<ArrayBuffer>;
}

let server: Server, client: Client, model: ModelOpened;
const came: Came[] = [];

before(async () => {
  server = await Server.start();
  client = await Client.connect(server.url);
  model = await client.open();
  client.on("volume", ({ frame, payload }) => came.push({ frame, payload: payload as Uint8Array<ArrayBuffer> }));
});
after(async () => {
  client?.close();
  await server?.stop();
});

async function subscribe(choice: { compressed?: boolean; changedBricks?: boolean; volume?: string }): Promise<number> {
  const value = create(SubscribeSchema, { what: { case: "volume", value: { volume: "ct", deformer: Deformer.TETS, ...choice } } });
  return (await client.ask({ case: "subscribe", value }, "subscribed")).value.subscription;
}

const frameOf = (subscription: number, sequence: bigint) => within(60, (async () => {
  for (;;) {
    const found = came.find(({ frame }) => frame.subscription === subscription && frame.poseSequence === sequence);
    if (found) return found;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
})(), `a volume of pose ${sequence}`);

const decode = ({ frame, payload }: Came, decoder = new VolumeDecoder(inflate)): VolumeImage => decoder.decode(frame, payload);
const copy = ({ frame, payload }: Came): Came => ({ frame: structuredClone(frame), payload: payload.slice() });
const refused = (run: () => void, what: string) => assert.throws(run, ProtocolError, what);

test("plain, packed and by bricks, frames hold the same voxels, and a client that lost the keyframe says so", async () => {
  const plain = await subscribe({}), packed = await subscribe({ compressed: true }), bricks = await subscribe({ compressed: true, changedBricks: true });
  const labels = await subscribe({ compressed: true, volume: "labels" });
  const decoder = new VolumeDecoder(inflate);
  let partial = 0;
  for (const sequence of [0n, 1n, 2n]) {
    if (sequence > 0n) {
      // The head alone: most bricks stay, and so does the grid.
      const head = model.skeleton!.segments.findIndex(({ name }) => name === "head"), half = 0.1 * Number(sequence);
      client.setPose({ rotation: model.skeleton!.segments.flatMap((_, joint) => (joint === head ? [Math.cos(half), 0, Math.sin(half), 0] : [1, 0, 0, 0])) });
    }
    const frames = await Promise.all([plain, packed, bricks, labels].map((subscription) => frameOf(subscription, sequence)));
    const [one, two, three, four] = [decode(frames[0]!), decode(frames[1]!), decode(frames[2]!, decoder), decode(frames[3]!)];
    assert.deepEqual(two, one);
    assert.deepEqual(three, one);
    assert.ok(one.voxels instanceof Int16Array && four.voxels.length > 1000 && one.voxels.some((value) => value > 300));
    assert.ok(frames[1]!.payload.length < frames[0]!.payload.length / 3);
    if (!frames[2]!.frame.bricks) continue;
    ++partial;
    refused(() => decode(frames[2]!), "a keyframe that did not come");
  }
  assert.ok(partial > 0, "no frame came by bricks");
});

test("every packed frame that is cut short or followed by something is refused", () => {
  const { payload, frame } = came.find((each) => each.frame.content && !each.frame.bricks)!;
  const packed = payload.slice(Number(frame.voxels!.offset), Number(frame.voxels!.offset + frame.voxels!.count));
  const size = Number(frame.content!.count) * 2;
  assert.equal(inflate(packed, size).length, size);
  const random = new Random(24);
  const lengths = [...Array.from({ length: 30 }, (_, at) => at), ...Array.from({ length: 40 }, () => random.below(packed.length)), packed.length - 1];
  for (const length of lengths) refused(() => inflate(packed.slice(0, length), size), `${length} of ${packed.length} bytes`);
  refused(() => inflate(Uint8Array.from([...packed, 0]), size), "a byte too many");
  refused(() => inflate(Uint8Array.from([...packed, ...packed]), size), "two frames");
  for (const lie of [0, size - 1, size + 1, 2 * size]) refused(() => inflate(packed, lie), `a size of ${lie}`);
});

test("flipped bytes give a frame of the size that was asked for, or are refused, and take no more room", () => {
  const { payload, frame } = came.find((each) => each.frame.content && !each.frame.bricks)!;
  const packed = payload.slice(Number(frame.voxels!.offset), Number(frame.voxels!.offset + frame.voxels!.count));
  const size = Number(frame.content!.count) * 2, random = new Random(7);
  let caught = 0;
  for (let turn = 0; turn < 60; ++turn) {
    const bad = packed.slice();
    for (let flip = 0; flip < 1 + turn % 3; ++flip) bad[turn < 20 ? random.below(32) : random.below(bad.length)] ^= 1 << random.below(8);
    try {
      assert.equal(inflate(bad, size).length, size);
    } catch (error) {
      assert.ok(error instanceof ProtocolError, String(error));
      ++caught;
    }
  }
  assert.ok(caught > 10, `${caught} of 60 were caught`);
});

test("a few bytes that say they hold gigabytes are refused before there is room for them", () => {
  // One block that repeats a byte: of 128 KiB, told as 1 GiB and as what it is.
  const frame = (told: number, block: number) => {
    const bytes = new Uint8Array(13), view = new DataView(bytes.buffer), head = 1 | (1 << 1) | (block << 3);
    view.setUint32(0, 0xfd2fb528, true);
    bytes[4] = 0b10000000;
    bytes[5] = 0x40;
    view.setUint32(6, told, true);
    bytes.set([head & 255, (head >> 8) & 255, head >> 16], 10);
    return Uint8Array.from([...bytes, 9]);
  };
  assert.ok(inflate(frame(131072, 131072), 131072).every((value) => value === 9));
  refused(() => inflate(frame(2 ** 30, 131072), 2 ** 30), "a GiB of one block");
  refused(() => inflate(frame(2 ** 21 - 1, 2 ** 21 - 1), 2 ** 21 - 1), "a block of 2 MiB");
  const window = frame(131072, 131072);
  window[5] = 0xf8;
  refused(() => inflate(window, 131072), "a window of 2 TiB");
});

const lies: [string, (frame: VolumeFrame, payload: Uint8Array) => void][] = [
  ["no grid", (frame) => { frame.grid = undefined; }],
  ["a grid of nothing", (frame) => { frame.grid!.sizeJ = 0; }],
  ["a grid that is larger", (frame) => { frame.grid!.sizeK += 1; }],
  ["a grid of 2^60 voxels", (frame) => { frame.grid!.sizeI = frame.grid!.sizeJ = frame.grid!.sizeK = 2 ** 20; }],
  ["a spacing that is no number", (frame) => { frame.grid!.spacing!.x = NaN; }],
  ["a spacing below nothing", (frame) => { frame.grid!.spacing!.z = -1; }],
  ["half a direction", (frame) => { frame.grid!.direction.length = 4; }],
  ["no voxels", (frame) => { frame.voxels = undefined; }],
  ["voxels of no type", (frame) => { frame.content!.type = 99 as ScalarType; }],
  ["voxels of no component", (frame) => { frame.content!.components = 0; }],
  ["a content elsewhere", (frame) => { frame.content!.offset = 16n; }],
  ["a content of 2^50 voxels", (frame) => { frame.content!.count = 2n ** 50n; }],
  ["voxels beyond the payload", (frame) => { frame.voxels!.count += 1000n; }],
  ["voxels that begin nowhere", (frame) => { frame.voxels!.offset = 2n ** 63n; }],
];
for (const [what, lie] of lies) {
  test(`a frame with ${what} is refused`, () => {
    const { frame, payload } = copy(came.find((each) => each.frame.content && !each.frame.bricks)!);
    lie(frame, payload);
    refused(() => new VolumeDecoder(inflate).decode(frame, payload), what);
  });
}

test("bricks that are not those of the grid are refused, and the keyframe stays as it was", () => {
  const changed = came.find((each) => each.frame.bricks)!, keyframe = came.find((each) => each.frame.frame === changed.frame.keyframe && each.frame.subscription === changed.frame.subscription)!;
  const decoder = new VolumeDecoder(inflate);
  decode(keyframe, decoder);
  const good = decode(changed, decoder);
  const wrong: [string, (frame: VolumeFrame, bricks: Uint32Array) => void][] = [
    ["the same twice", (_, bricks) => { bricks[1] = bricks[0]!; }],
    ["beyond the grid", (_, bricks) => { bricks[bricks.length - 1] = 2 ** 31; }],
    ["one too few", (frame) => { frame.bricks!.count -= 1n; }],
    ["one too many", (frame) => { frame.bricks!.count += 1n; }],
    ["of another grid", (frame) => { frame.grid!.origin!.x += 1; }],
    ["of another keyframe", (frame) => { frame.keyframe += 1n; }],
  ];
  for (const [what, change] of wrong) {
    const { frame, payload } = copy(changed);
    change(frame, new Uint32Array(payload.buffer, payload.byteOffset + Number(frame.bricks!.offset), Number(frame.bricks!.count)));
    refused(() => decoder.decode(frame, payload), what);
  }
  assert.deepEqual(decode(changed, decoder), good);
});
