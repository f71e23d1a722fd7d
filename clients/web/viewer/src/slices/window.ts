// SPDX-License-Identifier: Apache-2.0
// From numbers of a volume to greys, by window and level as DICOM has them (PS3.3 C.11.2.1.2.1), and labels in colour over them.

export interface Window {
  readonly level: number;
  readonly width: number;
}

export interface Preset extends Window {
  readonly name: string;
}

/** Hounsfield units. */
export const CT_PRESETS: readonly Preset[] = [
  { name: "Soft tissue", level: 40, width: 400 },
  { name: "Bone", level: 400, width: 1800 },
  { name: "Lung", level: -600, width: 1500 },
  { name: "Brain", level: 40, width: 80 },
];

export const presetOf = ({ level, width }: Window): Preset | undefined =>
  CT_PRESETS.find((preset) => preset.level === level && preset.width === width);

/** 0 to 255. */
export function greyOf(value: number, { level, width }: Window): number {
  const span = Math.max(width, 1) - 1, center = level - 0.5;
  if (value <= center - span / 2) return 0;
  if (value > center + span / 2) return 255;
  return Math.round(((value - center) / span + 0.5) * 255);
}

export type Numbers = Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array | Float32Array | Float64Array;

/** Greys of all numbers of a 16-bit type, from its smallest on: a look-up a pixel. */
class Table {
  readonly greys = new Uint8Array(65536);
  #of: Window | null = null;

  of(window: Window): Uint8Array {
    if (this.#of?.level !== window.level || this.#of.width !== window.width) {
      for (let i = 0; i < 65536; i++) this.greys[i] = greyOf(i - 32768, window);
      this.#of = window;
    }
    return this.greys;
  }
}
const table = new Table();

export interface Overlay {
  readonly labels: Numbers;
  /** Red, green, blue of a label; none: it has no colour. */
  readonly colors: ReadonlyMap<number, readonly [number, number, number]>;
  /** 0 to 1. */
  readonly opacity: number;
}

export interface Picture {
  /** Null: the labels alone. */
  readonly values: Numbers | null;
  /** What lies outside the body. */
  readonly background: number;
  readonly window: Window;
  readonly overlay: Overlay | null;
}

/** Red, green, blue and alpha a pixel; clear where the plane lies outside the body. */
export function paint({ values, background, window, overlay }: Picture, out: Uint8ClampedArray): void {
  const greys = values instanceof Int16Array || values instanceof Int8Array || values instanceof Uint8Array ? table.of(window) : null;
  const count = out.length / 4;
  for (let i = 0, at = 0; i < count; i++, at += 4) {
    const value = values ? values[i]! : background;
    const label = overlay ? overlay.labels[i]! : 0;
    if (value === background && label === 0) {
      out[at] = out[at + 1] = out[at + 2] = out[at + 3] = 0;
      continue;
    }
    const grey = !values ? 40 : greys ? greys[value + 32768]! : greyOf(value, window);
    const color = overlay && label !== 0 ? overlay.colors.get(label) : undefined;
    const share = color ? overlay!.opacity : 0;
    for (let channel = 0; channel < 3; channel++) out[at + channel] = grey + share * ((color?.[channel] ?? 0) - grey);
    out[at + 3] = 255;
  }
}

/** A window that holds nearly all numbers: of a volume whose unit nobody knows. */
export function windowRound(values: Numbers, background: number): Window {
  const inside = Array.from(values).filter((value) => value !== background && Number.isFinite(value)).sort((a, b) => a - b);
  if (inside.length === 0) return { level: 0, width: 1 };
  const at = (share: number) => inside[Math.min(inside.length - 1, Math.floor(share * inside.length))]!;
  const low = at(0.01), high = at(0.99);
  return { level: Math.round((low + high) / 2), width: Math.max(1, Math.round(high - low)) };
}
