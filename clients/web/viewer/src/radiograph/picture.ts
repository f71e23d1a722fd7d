// SPDX-License-Identifier: Apache-2.0
// Line integrals as a picture on a canvas: a window of greys, dense bright, and what a radiograph says of itself.
import { h } from "../panels/dom.js";
import type { Window } from "../slices/window.js";

export interface Integrals {
  readonly values: Float32Array;
  readonly columns: number;
  readonly rows: number;
}

/** What is written into the picture. */
export interface Marks {
  readonly marker: { readonly letter: string; readonly edge: "left" | "right" };
  readonly projection: string;
  /** What it is a picture of, and of which pose. */
  readonly what: string;
  readonly facts: string;
}

export const PURPOSE = "For training, not for planning surgery";

/** From nothing to the densest but a few stray pixels. */
export function fitWindow({ values }: Integrals): Window {
  const sorted = values.slice().sort(), most = sorted[Math.floor(0.999 * (sorted.length - 1))] ?? 0;
  const high = most > 0 ? Math.ceil(most * 10) / 10 : 1;
  return { level: high / 2, width: high };
}

/** 0 to 255, of a line integral. */
export function shadeOf(value: number, { level, width }: Window): number {
  return Math.max(0, Math.min(255, Math.round(255 * ((value - level) / width + 0.5))));
}

/** A canvas that shows integrals, with its own pixels: what is saved is what is seen. */
export class Picture {
  readonly canvas: HTMLCanvasElement;
  integrals: Integrals | null = null;
  marks: Marks | null = null;

  constructor(label: string) {
    this.canvas = h("canvas", { class: "radiograph", width: 512, height: 512, role: "img", aria: { label } });
  }

  draw(window: Window, inverted: boolean): void {
    const context = this.canvas.getContext("2d")!;
    if (!this.integrals) {
      context.fillStyle = "#000";
      context.fillRect(0, 0, this.canvas.width, this.canvas.height);
      return;
    }
    const { values, columns, rows } = this.integrals;
    const small = new OffscreenCanvas(columns, rows), image = new ImageData(columns, rows);
    const pixels = new Uint32Array(image.data.buffer);
    for (let i = 0; i < pixels.length; i++) {
      const grey = shadeOf(values[i]!, window), shown = inverted ? 255 - grey : grey;
      pixels[i] = 0xff000000 | (shown * 0x010101);
    }
    small.getContext("2d")!.putImageData(image, 0, 0);
    const scale = Math.max(1, 512 / Math.max(columns, rows));
    const width = Math.round(columns * scale), height = Math.round(rows * scale);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    context.imageSmoothingEnabled = true;
    context.drawImage(small, 0, 0, width, height);
    if (this.marks) write(context, this.marks, inverted);
  }
}

function write(context: CanvasRenderingContext2D, { marker, projection, what, facts }: Marks, inverted: boolean): void {
  const { width, height } = context.canvas, size = Math.max(13, Math.round(width / 34));
  const line = (text: string, x: number, y: number, align: CanvasTextAlign, font: string) => {
    context.font = font;
    context.textAlign = align;
    context.lineWidth = size / 4;
    context.lineJoin = "round";
    context.strokeStyle = inverted ? "rgb(255 255 255 / 0.8)" : "rgb(0 0 0 / 0.8)";
    context.fillStyle = inverted ? "#101010" : "#f2f2f2";
    context.strokeText(text, x, y);
    context.fillText(text, x, y);
  };
  const plain = `${size}px system-ui, sans-serif`, bold = `600 ${size}px system-ui, sans-serif`;
  line(projection, size, 1.6 * size, "left", bold);
  line(facts, width - size, 1.6 * size, "right", plain);
  // The lead letter that lies on a cassette.
  line(marker.letter, marker.edge === "left" ? size : width - size, 4.6 * size, marker.edge, `700 ${2 * size}px system-ui, sans-serif`);
  line(what, size, height - 2.2 * size, "left", plain);
  line(PURPOSE, size, height - 0.8 * size, "left", plain);
}
