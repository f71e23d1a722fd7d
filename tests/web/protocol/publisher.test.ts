// SPDX-License-Identifier: Apache-2.0
// Frames that go from thread to thread by shared memory are never torn, never older than the one before, and the last one always comes.
import assert from "node:assert/strict";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { isMainThread, parentPort, Worker, workerData } from "node:worker_threads";
import { makeControl, Pool, SharedReader, SharedWriter, SLOTS } from "../../../clients/web/protocol/src/publisher.js";
import { within } from "../support/server.js";

const FRAMES = 3000, NUMBERS = 20_000;

interface Shared {
  slots: Uint32Array[];
  control: Int32Array<SharedArrayBuffer>;
}

/** Each frame is its number, over and over. */
function write({ slots, control }: Shared): void {
  const writer = new SharedWriter(control);
  for (let frame = 1; frame <= FRAMES; ++frame) {
    slots[writer.slot].fill(frame);
    parentPort!.postMessage({ frame, word: writer.publish() });
  }
}

if (!isMainThread) {
  write(workerData as Shared);
} else {
  test("by shared memory", async () => {
    const shared: Shared = { slots: Array.from({ length: SLOTS }, () => new Uint32Array(new SharedArrayBuffer(4 * NUMBERS))), control: makeControl() };
    const reader = new SharedReader(shared.control), worker = new Worker(fileURLToPath(import.meta.url), { workerData: shared });
    let taken = 0, last = 0;
    await within(60, new Promise<void>((resolve, reject) => {
      worker.on("error", reject);
      worker.on("message", ({ frame, word }: { frame: number; word: number }) => {
        const slot = reader.take(word);
        if (slot !== undefined) {
          ++taken;
          const numbers = shared.slots[slot];
          if (numbers.some((number) => number !== frame)) reject(new Error(`frame ${frame} is torn: ${numbers[0]} to ${numbers[NUMBERS - 1]}`));
          if (frame <= last) reject(new Error(`${frame} after ${last}`));
          last = frame;
        }
        if (frame === FRAMES) resolve();
      });
    }), "the last frame");
    await worker.terminate();
    assert.equal(last, FRAMES);
    assert.ok(taken >= 1 && taken <= FRAMES);
  });

  test("by buffers to and fro: two of them, of the right size, in turn", () => {
    const pool = new Pool(8), one = pool.take()!, other = pool.take()!;
    assert.notEqual(one, other);
    assert.equal(pool.take(), undefined);
    pool.giveBack(new ArrayBuffer(4));
    assert.equal(pool.take(), undefined);
    pool.giveBack(one);
    assert.equal(pool.take(), one);
  });
}
