// SPDX-License-Identifier: Apache-2.0
// What a volume looks like by its numbers: colour and opacity along a window. Level and width move and stretch it.
import type { Window } from "../slices/window.js";

/** `at`: 0 to 1 along the window; `opacity`: of a millimetre. Below the window all is clear; beyond it all is as at its end. */
interface Stop {
  readonly at: number;
  /** sRGB. */
  readonly color: number;
  readonly opacity: number;
}

export interface TransferPreset extends Window {
  readonly name: string;
  readonly stops: readonly Stop[];
}

/** Hounsfield units. */
export const TRANSFER_PRESETS: readonly TransferPreset[] = [
  {
    name: "Bone", level: 700, width: 1000,
    stops: [{ at: 0, color: 0x7a3b22, opacity: 0 }, { at: 0.15, color: 0xb98a5e, opacity: 0.08 }, { at: 0.45, color: 0xe6d3ae, opacity: 0.45 }, { at: 1, color: 0xfff8e8, opacity: 0.9 }],
  },
  {
    name: "Soft tissue", level: 50, width: 500,
    stops: [
      { at: 0, color: 0xd9a066, opacity: 0 }, { at: 0.15, color: 0xe8b878, opacity: 0.01 }, { at: 0.4, color: 0xc6705a, opacity: 0.02 },
      { at: 0.55, color: 0xb0483c, opacity: 0.12 }, { at: 0.8, color: 0xd98c6e, opacity: 0.2 }, { at: 1, color: 0xfdf3dc, opacity: 0.6 },
    ],
  },
  {
    name: "Lung", level: -600, width: 700,
    stops: [
      { at: 0, color: 0x2b3a55, opacity: 0 }, { at: 0.12, color: 0x5a7fae, opacity: 0.01 }, { at: 0.45, color: 0xa8c4de, opacity: 0.04 },
      { at: 0.75, color: 0xe6b8ae, opacity: 0.05 }, { at: 0.92, color: 0xf0d8cc, opacity: 0.005 }, { at: 1, color: 0xf0d8cc, opacity: 0 },
    ],
  },
  {
    name: "Vessels", level: 280, width: 360,
    stops: [{ at: 0, color: 0x5c0b0b, opacity: 0 }, { at: 0.2, color: 0x9c1a14, opacity: 0.06 }, { at: 0.5, color: 0xd8402c, opacity: 0.4 }, { at: 0.8, color: 0xf4b48c, opacity: 0.6 }, { at: 1, color: 0xfff0dc, opacity: 0.7 }],
  },
];

/** Of numbers whose unit nobody knows: from clear to white. */
export const PLAIN: TransferPreset = {
  name: "Plain", level: 0, width: 1,
  stops: [{ at: 0, color: 0x202020, opacity: 0 }, { at: 0.4, color: 0x8c8c8c, opacity: 0.02 }, { at: 1, color: 0xffffff, opacity: 0.4 }],
};

export const TABLE_SIZE = 256;

const linear = (byte: number) => {
  const share = byte / 255;
  return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
};

/** Red, green and blue, linear, and the opacity of a millimetre, for places from 0 to 1 of the window. */
export function tableOf({ stops }: TransferPreset): Float32Array<ArrayBuffer> {
  const table = new Float32Array(4 * TABLE_SIZE);
  for (let i = 0; i < TABLE_SIZE; ++i) {
    const at = i / (TABLE_SIZE - 1), next = Math.max(1, stops.findIndex((stop) => stop.at >= at));
    const low = stops[next - 1]!, high = stops[next]!, share = (at - low.at) / (high.at - low.at);
    const mix = (from: number, to: number) => from + share * (to - from);
    for (let channel = 0; channel < 3; ++channel) {
      const byte = (color: number) => (color >> (16 - 8 * channel)) & 255;
      table[4 * i + channel] = linear(mix(byte(low.color), byte(high.color)));
    }
    table[4 * i + 3] = mix(low.opacity, high.opacity);
  }
  return table;
}

/** Whether anything between two places of the window can be seen: made once for a table, asked for every block. */
export class Visible {
  readonly #counts = new Uint32Array(TABLE_SIZE + 1);

  constructor(table: Float32Array) {
    for (let i = 0; i < TABLE_SIZE; ++i) this.#counts[i + 1] = this.#counts[i]! + (table[4 * i + 3]! > 0 ? 1 : 0);
  }

  between(low: number, high: number): boolean {
    const place = (at: number) => Math.min(1, Math.max(0, at)) * (TABLE_SIZE - 1);
    // Entries are mixed with their neighbours.
    return this.#counts[Math.ceil(place(high)) + 1]! > this.#counts[Math.floor(place(low))]!;
  }
}
