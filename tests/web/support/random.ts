// SPDX-License-Identifier: Apache-2.0
// Numbers and delta blocks that look like anything, the same in every run.

/** mulberry32: 0 to 2^32 - 1. */
export class Random {
  constructor(private state: number) {}

  next(): number {
    this.state = (this.state + 0x6d2b79f5) | 0;
    let t = Math.imul(this.state ^ (this.state >>> 15), 1 | this.state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return (t ^ (t >>> 14)) >>> 0;
  }

  below(end: number): number {
    return this.next() % end;
  }

  words(count: number): Uint16Array {
    return Uint16Array.from({ length: count }, () => this.next());
  }
}

export interface BlockChoice {
  digits: number;
  widths: [number, number, number];
  /** -32768 among the entries of the matrix, whose product with itself must wrap. */
  extreme?: boolean;
}

/** The deltas of `vertices` vertices, valid whatever their bits say. docs/reference/protocol.md, "Deltas". */
export function randomDeltas(random: Random, vertices: number, choose: (block: number) => BlockChoice): Uint8Array<ArrayBuffer> {
  const blocks: Uint8Array[] = [];
  for (let first = 0; first < vertices; first += 512) {
    const { digits, widths, extreme } = choose(first / 512), rows = Math.ceil(Math.min(512, vertices - first) / 32);
    const words = widths.reduce((sum, width) => sum + 32 * Math.ceil((rows * width) / 16), 0);
    const block = random.words(17 + words);
    new Uint8Array(block.buffer).set([digits, ...widths]);
    if (extreme) block[2 + random.below(9)] = 0x8000;
    blocks.push(new Uint8Array(block.buffer));
  }
  const bytes = new Uint8Array(blocks.reduce((sum, block) => sum + block.length, 0));
  let at = 0;
  for (const block of blocks) {
    bytes.set(block, at);
    at += block.length;
  }
  return bytes;
}
