// SPDX-License-Identifier: Apache-2.0
// The decoder of deltas in WebAssembly, its twin in plain numbers, and the one in Python agree on every block there can be, and refuse
// the same ones.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import { makePlainKernel, type MakeKernel } from "../../../clients/web/protocol/src/decode/kernel.js";
import { loadWasmKernel } from "../../../clients/web/protocol/src/decode/wasm_kernel.js";
import { ProtocolError } from "../../../clients/web/protocol/src/index.js";
import { Random, randomDeltas, type BlockChoice } from "../support/random.js";

declare const ROOT: string;
const DIGITS = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 255];
const wasm = (await loadWasmKernel())!;
const kinds: [string, MakeKernel, boolean][] = [["plain", makePlainKernel, false], ["wasm", wasm, false], ["wasm in shared memory", wasm, true]];

/** The vertices that deltas against `keys` make, of one tissue beside another. */
function decode(make: MakeKernel, shared: boolean, keys: Uint16Array[], deltas: Uint8Array[], normals?: Int8Array[]): Uint16Array {
  let firstVertex = 0;
  const ranges = keys.map((key, tissue) => {
    const range = { tissue, firstVertex, vertexCount: key.length / 3, firstIndex: 0, indexCount: 0 };
    firstVertex += range.vertexCount;
    return range;
  });
  const kernel = make({ ranges, vertexCount: firstVertex, slots: 2, deltas: true, shared });
  ranges.forEach((range, i) => kernel.packNumbers(1, range, keys[i], normals?.[i], true));
  // The last tissue first: who writes beyond an end destroys what is already there.
  [...ranges].reverse().forEach((range) => kernel.decodeDeltas(0, range, deltas[range.tissue], normals?.[range.tissue]));
  return kernel.slots[0].slice();
}

function agree(random: Random, counts: number[], choose: (block: number) => BlockChoice, withNormals = false): Uint16Array {
  const keys = counts.map((count) => random.words(3 * count)), deltas = counts.map((count) => randomDeltas(random, count, choose));
  const normals = withNormals ? counts.map((count) => new Int8Array(random.words(count).buffer)) : undefined;
  const [first, ...others] = kinds.map(([, make, shared]) => decode(make, shared, keys, deltas, normals));
  others.forEach((other, i) => assert.deepEqual(other, first, kinds[i + 1][0]));
  return first;
}

test("every number of digits with every width", () => {
  const random = new Random(1);
  for (const digits of DIGITS) {
    for (let width = 0; width <= 16; ++width) {
      agree(random, [512 + 77], () => ({ digits, widths: [width, (width + 5) % 17, (width + 11) % 17] }));
    }
  }
});

test("every number of vertices to a block and beyond, beside another tissue, with normals", () => {
  const random = new Random(2);
  const any = (): BlockChoice => ({
    digits: DIGITS[random.below(DIGITS.length)], widths: [random.below(17), random.below(17), random.below(17)], extreme: random.below(4) === 0,
  });
  for (let count = 1; count <= 540; count += count < 70 ? 1 : 13) agree(random, [count, 9, count], any, count % 2 === 0);
});

test("a product of the two least numbers wraps", () => {
  const random = new Random(3), keys = [new Uint16Array(3 * 64).fill(0x8000)];
  const deltas = [randomDeltas(random, 64, () => ({ digits: 0, widths: [0, 0, 0] }))], numbers = new Uint16Array(deltas[0].buffer);
  numbers.fill(0x8000, 2, 11);   // the matrix
  numbers.fill(0x6000, 11, 14);  // the centre: (key - centre) << 2 is the least number
  const [first, ...others] = kinds.map(([, make, shared]) => decode(make, shared, keys, deltas));
  assert.equal(first[0], (3 * 0x8000 + numbers[14]) & 0xffff);
  for (const other of others) assert.deepEqual(other, first);
});

test("the decoder in Python agrees", () => {
  const random = new Random(4), count = 512 * 44 + 100;
  const key = random.words(3 * count);
  const deltas = randomDeltas(random, count, (block) => ({
    digits: DIGITS[block % DIGITS.length], widths: [block % 17, (block * 7) % 17, (block * 5 + 3) % 17], extreme: block % 3 === 0,
  }));
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-deltas-"));
  try {
    for (const [name, bytes] of Object.entries({ key, deltas })) fs.writeFileSync(path.join(folder, name), new Uint8Array(bytes.buffer));
    const program = `
import sys, numpy as np
sys.path.insert(0, sys.argv[1])
import ecorche_encodings
key = np.fromfile("key", "<u2").reshape(-1, 3)
ecorche_encodings.decode_delta(np.fromfile("deltas", "u1"), key).astype("<u2").tofile("out")`;
    const { status, stderr } = spawnSync("/usr/bin/python3", ["-c", program, path.join(ROOT, "clients/python")], { cwd: folder, encoding: "utf8" });
    assert.equal(status, 0, stderr);
    const expected = new Uint16Array(new Uint8Array(fs.readFileSync(path.join(folder, "out"))).buffer);
    const found = decode(wasm, false, [key], [deltas]);
    assert.equal(expected.length, 3 * count);
    for (let v = 0; v < count; ++v) {
      for (let axis = 0; axis < 3; ++axis) assert.equal(found[4 * v + axis], expected[3 * v + axis], `vertex ${v}`);
    }
  } finally {
    fs.rmSync(folder, { recursive: true, force: true });
  }
});

test("every beginning of deltas is refused, and more than all of them", () => {
  const random = new Random(5), count = 512 + 40, key = random.words(3 * count);
  const whole = randomDeltas(random, count, () => ({ digits: 3, widths: [4, 0, 16] }));
  const longer = new Uint8Array(whole.length + 2);
  longer.set(whole);
  const pieces = [longer];
  for (let length = 0; length < whole.length; length += length < 80 ? 1 : 31) pieces.push(whole.slice(0, length));
  for (const [name, make, shared] of kinds) {
    for (const piece of pieces) assert.throws(() => decode(make, shared, [key], [piece]), ProtocolError, `${name}, ${piece.length} bytes`);
  }
});

test("digits and widths that do not exist are refused", () => {
  const random = new Random(6), key = random.words(3 * 40);
  for (const [name, make, shared] of kinds) {
    for (const head of [[10, 0, 0, 0], [254, 0, 0, 0], [0, 17, 0, 0], [0, 0, 0, 255], [255, 0, 17, 0]]) {
      const deltas = new Uint8Array(34 + 3 * 2 * 32 * 32);
      deltas.set(head);
      assert.throws(() => decode(make, shared, [key], [deltas]), ProtocolError, `${name}, ${head}`);
    }
  }
});

test("bytes that were turned over either decode alike everywhere, or are refused everywhere", () => {
  const random = new Random(7), count = 600, key = random.words(3 * count);
  let refused = 0;
  for (let round = 0; round < 300; ++round) {
    const deltas = randomDeltas(random, count, () => ({ digits: 2, widths: [5, 6, 7] }));
    deltas[random.below(2) === 0 ? random.below(8) : random.below(deltas.length)] ^= 1 << random.below(8);
    const outcomes = kinds.map(([, make, shared]) => {
      try {
        return decode(make, shared, [key], [deltas]);
      } catch (error) {
        assert.ok(error instanceof ProtocolError, String(error));
        return "refused";
      }
    });
    refused += Number(outcomes[0] === "refused");
    for (const outcome of outcomes) assert.deepEqual(outcome, outcomes[0]);
  }
  assert.ok(refused > 30 && refused < 270, `${refused} of 300`);
});
