// SPDX-License-Identifier: Apache-2.0
// One plane on the page: its picture, the lines of the other planes, letters of the patient's sides, a scale, and what else draws on it.
import type { Vec3 } from "../posing/rotation.js";
import { h, iconButton, setText } from "../panels/dom.js";
import { ORIENTATIONS, orientationOf, pixelOf, pointAt, position, type Orientation, type PlaneGeometry, type PlaneId } from "./plane.js";

/** Draws over the picture: `place` gives pixels of CSS, and how far in front of the plane a point is, mm. */
export type Draw = (context: CanvasRenderingContext2D, place: (point: Vec3) => { x: number; y: number; off: number }, plane: PlaneGeometry) => void;

const css = (color: number): string => `#${color.toString(16).padStart(6, "0")}`;
const GAP = 9;
const SCALES = [1, 2, 5, 10, 20, 50, 100, 200, 500];
const MOST_ZOOM = 40;
// Pixels round a picture that is fitted, for letters and words.
const SIDE = 16;
const EDGE = 32;

export class PlaneView {
  readonly canvas = h("canvas", { tabIndex: 0 });
  readonly orientation: Orientation;
  readonly root: HTMLElement;
  readonly #place = h("output", { class: "plane-place" });
  readonly #read = h("output", { class: "plane-read" });
  readonly #note = h("span", { class: "plane-note" });
  readonly #whole: HTMLButtonElement;
  #picture: HTMLCanvasElement | null = null;
  #plane: PlaneGeometry | null = null;
  #cross: Vec3 = [0, 0, 0];
  #zoom = 1;
  /** Of the picture's middle from the plane's, mm, to the right and down. */
  #pan: [number, number] = [0, 0];
  #wanted = 0;
  smooth = true;
  draws: readonly Draw[] = [];

  constructor(readonly id: PlaneId, toWhole: () => void) {
    this.orientation = orientationOf(id);
    const { letters, title } = this.orientation;
    this.#whole = iconButton("M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5", `${title} alone, or all`, toWhole);
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title} plane. Arrows step by a slice, with Shift they move the cross-hair, plus and minus zoom.`);
    this.root = h("div", { class: "plane", data: { plane: id } }, this.canvas,
      h("div", { class: "plane-head" }, h("b", {}, title), this.#place),
      ...(["left", "right", "top", "bottom"] as const).map((side, i) => h("span", { class: "letter", data: { side }, aria: { hidden: true } }, letters[i]!)),
      this.#note, this.#read, this.#whole);
    new ResizeObserver(() => this.invalidate()).observe(this.root);
  }

  get plane(): PlaneGeometry | null {
    return this.#plane;
  }

  show(plane: PlaneGeometry, picture: HTMLCanvasElement): void {
    this.#plane = plane;
    this.#picture = picture;
    this.invalidate();
  }

  set cross(point: Vec3) {
    this.#cross = point;
    const { normal } = this.orientation;
    setText(this.#place, position(this.orientation, point[normal]!));
    this.invalidate();
  }

  /** What stands in the lower left corner: the window. And in the lower right one: what is under the pointer. */
  say(note: string, read: string): void {
    setText(this.#note, note);
    setText(this.#read, read);
  }

  set isWhole(on: boolean) {
    this.#whole.setAttribute("aria-pressed", String(on));
  }

  invalidate(): void {
    this.#wanted ||= requestAnimationFrame(() => {
      this.#wanted = 0;
      this.draw();
    });
  }

  /** Pixels of CSS from the upper left to the patient's mm, in the plane. */
  pointAt(x: number, y: number): Vec3 | null {
    const plane = this.#plane, look = this.#look();
    return plane && look ? pointAt(plane, (x - look.x) / look.scaleX, (y - look.y) / look.scaleY) : null;
  }

  placeOf(point: Vec3): { x: number; y: number; off: number } | null {
    const plane = this.#plane, look = this.#look();
    if (!plane || !look) return null;
    const { column, row, off } = pixelOf(plane, point);
    return { x: look.x + column * look.scaleX, y: look.y + row * look.scaleY, off };
  }

  /** mm a pixel of CSS. */
  get mmPerPixel(): number {
    const look = this.#look();
    return look ? this.#plane!.pixel[0] / look.scaleX : 1;
  }

  fit(): void {
    this.#zoom = 1;
    this.#pan = [0, 0];
    this.invalidate();
  }

  /** What is at (x, y) stays there. */
  zoom(factor: number, x: number, y: number): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const before = this.mmPerPixel;
    this.#zoom = Math.min(MOST_ZOOM, Math.max(0.5, this.#zoom * factor));
    const change = before - this.mmPerPixel;
    this.#pan = [this.#pan[0] + change * (x - width / 2), this.#pan[1] + change * (y - height / 2)];
    this.invalidate();
  }

  zoomBy(factor: number): void {
    const at = this.placeOf(this.#cross);
    if (at) this.zoom(factor, at.x, at.y);
  }

  /** By pixels of CSS. */
  pan(x: number, y: number): void {
    const mm = this.mmPerPixel;
    this.#pan = [this.#pan[0] - x * mm, this.#pan[1] - y * mm];
    this.invalidate();
  }

  /** Where the plane's first pixel is centred, and how far its pixels are apart, pixels of CSS. */
  #look(): { x: number; y: number; scaleX: number; scaleY: number } | null {
    const plane = this.#plane;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!plane || width === 0 || height === 0) return null;
    const [pixelX, pixelY] = plane.pixel, sizeX = plane.width * pixelX, sizeY = plane.height * pixelY;
    const perMm = Math.max(0.02, Math.min((width - 2 * SIDE) / sizeX, (height - 2 * EDGE) / sizeY)) * this.#zoom;
    const corner = (size: number, extent: number, step: number, pan: number) => size / 2 - perMm * (extent / 2 - step / 2 + pan);
    return {
      x: corner(width, sizeX, pixelX, this.#pan[0]), y: corner(height, sizeY, pixelY, this.#pan[1]),
      scaleX: perMm * pixelX, scaleY: perMm * pixelY,
    };
  }

  draw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas, ratio = Math.min(devicePixelRatio, 2);
    const look = this.#look(), context = this.canvas.getContext("2d");
    if (!context || width === 0) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = "#000";
    context.fillRect(0, 0, width, height);
    const plane = this.#plane;
    if (!look || !plane || !this.#picture) return;
    context.imageSmoothingEnabled = this.smooth;
    context.imageSmoothingQuality = "high";
    context.drawImage(this.#picture, look.x - look.scaleX / 2, look.y - look.scaleY / 2, plane.width * look.scaleX, plane.height * look.scaleY);
    const place = (point: Vec3) => this.placeOf(point)!;
    this.#drawCross(context, place(this.#cross), width, height);
    this.#drawScale(context, width, height);
    for (const draw of this.draws) draw(context, place, plane);
  }

  #drawCross(context: CanvasRenderingContext2D, at: { x: number; y: number }, width: number, height: number): void {
    const { right, down } = this.orientation;
    const color = (axis: number) => css(ORIENTATIONS.find(({ normal }) => normal === axis)!.color);
    const x = Math.round(at.x) + 0.5, y = Math.round(at.y) + 0.5;
    context.lineWidth = 1;
    context.globalAlpha = 0.85;
    const line = (style: string, ...ends: [number, number, number, number][]) => {
      context.strokeStyle = style;
      context.beginPath();
      for (const [x1, y1, x2, y2] of ends) {
        context.moveTo(x1, y1);
        context.lineTo(x2, y2);
      }
      context.stroke();
    };
    // Free in the middle, so that what one points at is seen.
    line(color(right), [x, 0, x, y - GAP], [x, y + GAP, x, height]);
    line(color(down), [0, y, x - GAP, y], [x + GAP, y, width, y]);
    context.globalAlpha = 1;
  }

  /** A bar of a round length at the lower left. */
  #drawScale(context: CanvasRenderingContext2D, width: number, height: number): void {
    const mm = this.mmPerPixel;
    const length = SCALES.filter((each) => each / mm <= width * 0.28).at(-1) ?? 1;
    const pixels = length / mm, left = 11.5, y = height - 30.5;
    context.strokeStyle = context.fillStyle = "#e8e8e8";
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(left, y);
    context.lineTo(left + pixels, y);
    for (let i = 0; i <= 5; i++) {
      const x = left + (pixels * i) / 5;
      context.moveTo(x, y);
      context.lineTo(x, y - (i % 5 === 0 ? 6 : 3));
    }
    context.stroke();
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillText(`${length} mm`, left + pixels + 6, y - 2);
  }
}
