// SPDX-License-Identifier: Apache-2.0
// How vertices get from the thread that decodes to the one that draws: through shared memory, or, where a page is not cross-origin
// isolated and has none, in buffers that go to and fro. Either way the newest frame wins, and no frame allocates.

/**
 * Three slots: one is written, one is the newest, one is drawn. `control[0]` is the newest's word: its slot, FRESH until it is taken,
 * and a count, so that a word is of one frame.
 */
const SLOT = 3, FRESH = 4, COUNT = 8;
export const SLOTS = 3;
const FIRST_NEWEST = 1, FIRST_DRAWN = 2;

export function makeControl(): Int32Array<SharedArrayBuffer> {
  const control = new Int32Array(new SharedArrayBuffer(4));
  control[0] = FIRST_NEWEST;
  return control;
}

/** The writer's side. */
export class SharedWriter {
  /** The slot to write. */
  slot = 0;
  private count = 0;

  constructor(readonly control: Int32Array<SharedArrayBuffer>) {}

  /** Makes what was written the newest; returns its word. */
  publish(): number {
    const word = (this.slot | FRESH | (++this.count * COUNT)) | 0;
    this.slot = Atomics.exchange(this.control, 0, word) & SLOT;
    return word;
  }
}

/** The drawer's side. */
export class SharedReader {
  private slot = FIRST_DRAWN;

  constructor(private readonly control: Int32Array) {}

  /** The slot of the frame of this word, which is then the drawer's; undefined where a newer one is there, whose note follows. */
  take(word: number): number | undefined {
    if (Atomics.compareExchange(this.control, 0, word, this.slot) !== word) return undefined;
    this.slot = word & SLOT;
    return this.slot;
  }
}

/** Buffers of one size: two, so that one is drawn while the other is on its way. */
export class Pool {
  private readonly free: ArrayBuffer[] = [];
  private made = 0;

  constructor(private readonly bytes: number) {}

  take(): ArrayBuffer | undefined {
    const buffer = this.free.pop();
    if (buffer || this.made === 2) return buffer;
    ++this.made;
    return new ArrayBuffer(this.bytes);
  }

  giveBack(buffer: ArrayBuffer): void {
    if (buffer.byteLength === this.bytes) this.free.push(buffer);
  }
}
