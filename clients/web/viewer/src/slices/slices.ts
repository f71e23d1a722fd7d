// SPDX-License-Identifier: Apache-2.0
// The planes through the cross-hair, kept current: asked for where the body is, painted when anything of them changes.
import type { App } from "../app.js";
import type { Client, ModelOpened, Volume } from "../../../protocol/src/index.js";
import type { Vec3 } from "../posing/rotation.js";
import { lookOf } from "../scene/palette.js";
import { labelOf } from "../state/names.js";
import { Store } from "../state/store.js";
import { fieldRound, latticeOf, ORIENTATIONS, orientationOf, pixelOf, planeThrough, samePlane, snap, within, type Lattice, type PlaneGeometry, type PlaneId, type Range } from "./plane.js";
import { PlaneFeed, type PlanePicture } from "./plane_feed.js";
import { firstSlices, type SliceState, type SliceVolume } from "./state.js";
import { CT_PRESETS, paint, windowRound, type Window } from "./window.js";

/** A plane as it is painted. */
export interface Painted {
  readonly plane: PlaneGeometry;
  readonly canvas: HTMLCanvasElement;
}

interface Layers {
  grey: PlanePicture | null;
  labels: PlanePicture | null;
  readonly canvas: HTMLCanvasElement;
}

const AIR = -900;
const MARGIN = 4;
// A moving body is measured so often: it goes over all of its vertices.
const MEASURE_MS = 250;

export class Slices {
  readonly store = new Store<SliceState>(firstSlices());
  readonly #feed: PlaneFeed;
  readonly #layers = new Map<PlaneId, Layers>(ORIENTATIONS.map(({ id }) => [id, { grey: null, labels: null, canvas: document.createElement("canvas") }]));
  readonly #painted = new Set<(id: PlaneId, painted: Painted) => void>();
  #volumes: readonly Volume[] = [];
  #lattice: Lattice = { origin: [0, 0, 0], step: [1, 1, 1] };
  #field: Range | null = null;
  #colors = new Map<number, readonly [number, number, number]>();
  #names: ReadonlyMap<number, string> = new Map();
  #measured = 0;
  #later: ReturnType<typeof setTimeout> | undefined;
  #identity = 0n;

  constructor(private readonly app: App) {
    this.#feed = new PlaneFeed((picture) => this.#take(picture), (problem) => app.say(problem));
    app.live.onOpened(({ client, model }) => this.#opened(client, model));
    app.live.onBody(() => this.#bodyMoved());
    const { store } = this;
    const again = () => this.#ask();
    for (const select of [(s: SliceState) => s.open, (s: SliceState) => s.volume, (s: SliceState) => s.labels, (s: SliceState) => s.cross]) store.watch<unknown>(select, again);
    const repaint = () => this.#paintAll();
    store.watch((state) => state.window, repaint);
    store.watch((state) => state.overlay, repaint);
  }

  get lattice(): Lattice {
    return this.#lattice;
  }

  /** The volume that is shown in greys. */
  get volume(): SliceVolume | undefined {
    const { volumes, volume } = this.store.state;
    return volumes.find(({ name }) => name === volume);
  }

  onPainted(listener: (id: PlaneId, painted: Painted) => void): void {
    this.#painted.add(listener);
  }

  /** Where the planes cross; the nearest voxel's centre, within the body's field. */
  moveTo(point: Vec3): void {
    const inside = this.#field ? point.map((value, axis) => Math.min(this.#field!.high[axis]!, Math.max(this.#field!.low[axis]!, value))) as unknown as Vec3 : point;
    const cross = snap(inside, this.#lattice), before = this.store.state.cross;
    if (cross.some((value, axis) => value !== before[axis])) this.store.set({ cross });
  }

  /** By so many voxels along an axis of LPS. */
  step(axis: number, by: number): void {
    const cross = [...this.store.state.cross];
    cross[axis]! += by * this.#lattice.step[axis]!;
    this.moveTo(cross as unknown as Vec3);
  }

  setWindow(window: Window): void {
    this.store.set({ window: { level: Math.round(window.level), width: Math.max(1, Math.round(window.width)) } });
  }

  setVolume(name: string | null): void {
    const volume = this.store.state.volumes.find((each) => each.name === name);
    this.store.set({ volume: name, ...(volume?.hounsfield ? { window: { level: CT_PRESETS[0]!.level, width: CT_PRESETS[0]!.width } } : {}) });
    this.#windowed = volume?.hounsfield ?? true;
  }
  /** The window has been chosen for this volume. */
  #windowed = true;

  /** What a plane holds at a point of it. */
  read(id: PlaneId, point: Vec3): { value: number | null; tissue: string } {
    const { grey, labels } = this.#layers.get(id)!;
    const at = (picture: PlanePicture | null) => {
      if (!picture) return null;
      const { column, row } = pixelOf(picture.plane, point);
      const i = Math.round(column), j = Math.round(row), { width, height } = picture.plane;
      return i < 0 || j < 0 || i >= width || j >= height ? null : picture.values[j * width + i]!;
    };
    const label = at(labels);
    return { value: at(grey), tissue: label ? this.#names.get(label) ?? `Label ${label}` : "" };
  }

  #opened(client: Client, model: ModelOpened): void {
    this.#feed.follow(client);
    if (model.identity === this.#identity) return;
    this.#identity = model.identity;
    this.#volumes = model.volumes;
    const greys = model.volumes.filter(({ labels }) => !labels).map(({ name, background }) => ({ name, background, hounsfield: background <= AIR }));
    const labels = model.volumes.find((volume) => volume.labels);
    const first = greys[0]?.name ?? labels?.name;
    const grid = model.volumes.find(({ name }) => name === first)?.grid;
    if (grid) this.#lattice = latticeOf(grid);
    this.#colors = new Map();
    const names = new Map<number, string>();
    for (const [key, name] of Object.entries(labels?.table ?? {})) {
      const tissue = model.tissues.find((each) => each.name === name), { color } = lookOf(name, tissue?.group ?? "other");
      names.set(Number(key), labelOf(name));
      this.#colors.set(Number(key), [color >> 16, (color >> 8) & 255, color & 255]);
    }
    this.#names = names;
    this.#field = null;
    for (const layer of this.#layers.values()) layer.grey = layer.labels = null;
    this.store.set({ volumes: greys, labels: labels?.name ?? null, volume: null });
    this.setVolume(greys[0]?.name ?? null);
    this.#bodyMoved();
  }

  /** A body that has moved out of the field of the planes gets another one. */
  #bodyMoved(): void {
    if (!this.store.state.open || this.#volumes.length === 0) return;
    clearTimeout(this.#later);
    const wait = this.#measured + MEASURE_MS - performance.now();
    if (wait > 0) {
      this.#later = setTimeout(() => this.#bodyMoved(), wait);
      return;
    }
    this.#measured = performance.now();
    const { positions, topology } = this.app.body;
    if (!positions || !topology) return;
    const { min, max } = this.app.body.bounds(topology.ranges.map(({ row }) => row));
    const box: Range = { low: [min.x, min.y, min.z], high: [max.x, max.y, max.z] };
    const tight = fieldRound(box, this.#lattice, MARGIN), loose = fieldRound(box, this.#lattice, 8 * MARGIN);
    if (this.#field && within(box, this.#field) && within(this.#field, loose)) return;
    const first = this.#field === null;
    this.#field = tight;
    if (first) this.moveTo([0, 1, 2].map((axis) => (box.low[axis]! + box.high[axis]!) / 2) as unknown as Vec3);
    this.#ask();
  }

  #ask(): void {
    if (this.store.state.open && !this.#field) return this.#bodyMoved();  // which asks, once it knows where the body is
    const { open, volume, labels, cross } = this.store.state;
    const names = [volume, labels].filter((name): name is string => name !== null);
    if (!open || !this.#field) return this.#feed.want([], []);
    this.#feed.want(ORIENTATIONS.map((each) => planeThrough(each, cross, this.#field!, this.#lattice)), names);
  }

  #take(picture: PlanePicture): void {
    const layers = this.#layers.get(picture.plane.id)!, { volume, labels } = this.store.state;
    if (picture.volume === labels) layers.labels = picture;
    else if (picture.volume === volume) layers.grey = picture;
    else return;
    if (!this.#windowed && layers.grey) {
      this.#windowed = true;
      this.setWindow(windowRound(layers.grey.values, this.volume?.background ?? 0));
    }
    this.#paint(picture.plane.id);
    if (picture.poseSequence !== this.store.state.poseSequence) this.store.set({ poseSequence: picture.poseSequence });
  }

  #paintAll(): void {
    for (const { id } of ORIENTATIONS) this.#paint(id);
  }

  /** Both layers of one place and pose, or what there is of the newer one. */
  #paint(id: PlaneId): void {
    const { grey, labels, canvas } = this.#layers.get(id)!;
    const { volume, labels: labelled, window, overlay } = this.store.state;
    const main = volume ? grey : labels;
    if (!main) return;
    const over = labels && labelled && samePlane(labels.plane, main.plane) ? { labels: labels.values, colors: this.#colors, opacity: volume ? overlay : 1 } : null;
    const { width, height } = main.plane;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d")!;
    const image = context.createImageData(width, height);
    paint({ values: volume ? main.values : null, background: this.volume?.background ?? 0, window, overlay: over }, image.data);
    context.putImageData(image, 0, 0);
    for (const listener of [...this.#painted]) listener(id, { plane: main.plane, canvas });
  }
}

/** The axis along which a plane steps. */
export const axisOf = (id: PlaneId): number => orientationOf(id).normal;
