// SPDX-License-Identifier: Apache-2.0
// Frames and arrays of hostile bytes: every one that is no frame is refused before anything is made of it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { arrayOf, decodeFrame, encodeFrame, ProtocolError } from "../../../clients/web/protocol/src/framing.js";
import { ScalarType } from "../../../clients/web/protocol/src/index.js";
import { Random } from "../support/random.js";

const bytes = (hex: string) => Uint8Array.from(hex.match(/../g)!, (pair) => parseInt(pair, 16));
/** The example of docs/reference/protocol.md: a ping with request 5 and a payload of 16 bytes. */
const PING = bytes("0900000010000000" + "0805c202040a026869" + "00".repeat(15) + "a0a1a2a3a4a5a6a7a8a9aaabacadaeaf");

test("the frame that the protocol's page shows", () => {
  const { envelope, payload } = decodeFrame(PING.buffer);
  assert.equal(envelope.length, 9);
  assert.equal(payload[15], 0xaf);
  assert.deepEqual(encodeFrame(envelope, payload), PING);
});

test("frames of every size come back as they were, aligned", () => {
  for (let size = 1; size < 70; ++size) {
    const frame = encodeFrame(new Uint8Array(size).fill(7), new Uint8Array(size).fill(9));
    const { envelope, payload } = decodeFrame(frame.buffer);
    assert.equal(frame.length % 16, 0);
    assert.equal(payload.byteOffset % 16, 0);
    assert.deepEqual([envelope.length, payload.length], [size, Math.ceil(size / 16) * 16]);
    assert.ok(payload.subarray(size).every((byte) => byte === 0));
  }
  assert.throws(() => encodeFrame(new Uint8Array()), /empty/);
});

test("every beginning is refused, and whatever is longer", () => {
  for (let length = 0; length < PING.length; ++length) assert.throws(() => decodeFrame(PING.slice(0, length).buffer), ProtocolError, `${length}`);
  const longer = new Uint8Array(PING.length + 16);
  longer.set(PING);
  assert.throws(() => decodeFrame(longer.buffer), ProtocolError);
});

test("lying lengths are refused", () => {
  const lie = (envelopeBytes: number, payloadBytes: number) => {
    const frame = PING.slice(), head = new DataView(frame.buffer);
    head.setUint32(0, envelopeBytes, true);
    head.setUint32(4, payloadBytes, true);
    return frame.buffer;
  };
  for (const [envelope, payload] of [[0, 16], [9, 0], [9, 15], [9, 32], [0xffffffff, 16], [9, 0xfffffff0], [0xfffffff0, 0xfffffff0], [1, 32]]) {
    assert.throws(() => decodeFrame(lie(envelope, payload)), ProtocolError, `${envelope} ${payload}`);
  }
});

test("a payload that is no multiple of 16 is refused, though all lengths agree", () => {
  const frame = new Uint8Array(32 + 24);
  frame.set(PING.subarray(0, 32));
  new DataView(frame.buffer).setUint32(4, 24, true);
  assert.throws(() => decodeFrame(frame.buffer), ProtocolError);
});

test("padding that is not zero is refused", () => {
  for (let at = 17; at < 32; ++at) {
    const frame = PING.slice();
    frame[at] = 1;
    assert.throws(() => decodeFrame(frame.buffer), /padding/);
  }
});

test("any bytes are a frame or a ProtocolError", () => {
  const random = new Random(8);
  for (let round = 0; round < 5000; ++round) {
    const frame = random.below(2) === 0 ? PING.slice() : Uint8Array.from(random.words(random.below(80)));
    if (frame.length > 0) frame[random.below(Math.min(frame.length, 32))] ^= random.below(256);
    try {
      decodeFrame(frame.buffer);
    } catch (error) {
      assert.ok(error instanceof ProtocolError, String(error));
    }
  }
});

test("an array must lie within its payload, aligned, and be of the type that is expected", () => {
  const { payload } = decodeFrame(encodeFrame(new Uint8Array(3), Uint8Array.from({ length: 64 }, (_, i) => i)).buffer);
  const array = (offset: bigint, count: bigint, components = 3, type: ScalarType = ScalarType.U16) =>
    ({ $typeName: "ecorche.v1.Array" as const, type, components, count, offset });
  const read = (description: ReturnType<typeof array> | undefined) => arrayOf(description, payload, ScalarType.U16, 3);
  assert.equal(read(array(16n, 2n))[0], 0x1110);
  assert.equal(read(array(0n, 10n)).length, 30);
  assert.equal(read(array(64n, 0n)).length, 0);
  const wrong = [
    array(1n, 1n), array(8n, 1n), array(0n, 11n), array(48n, 3n), array(80n, 0n), array(0n, 2n ** 63n), array(2n ** 64n - 16n, 3n),
    array(0n, 2n ** 64n - 1n), array(0n, 1n, 2), array(0n, 1n, 0), array(0n, 1n, 3, ScalarType.F32), array(0n, 1n, 3, ScalarType.UNSPECIFIED),
  ];
  for (const description of wrong) assert.throws(() => read(description), ProtocolError, JSON.stringify(description, (_, x) => (typeof x === "bigint" ? String(x) : x)));
  assert.throws(() => read(undefined), ProtocolError);
});
