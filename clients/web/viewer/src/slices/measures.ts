// SPDX-License-Identifier: Apache-2.0
// The list of measures, and the one that is being made. The server says where a point of the posed body was scanned, and where it went.
import { length, subtract, type Vec3 } from "../posing/rotation.js";
import type { History } from "../state/history.js";
import { Store } from "../state/store.js";
import { pointsOf, spell, valuesOf, type Measure, type MeasureKind, type MeasurePoint } from "./measure.js";
import { wordsOf } from "../errors.js";

export interface MeasureState {
  readonly list: readonly Measure[];
  /** What is being measured, and its points so far. */
  readonly draft: { readonly kind: MeasureKind; readonly points: readonly MeasurePoint[] } | null;
  /** Where the next point would be. */
  readonly tip: Vec3 | null;
}

/** The other side of points, 3 numbers each; NaN outside the body. */
export type Probe = (points: readonly number[], toPosed: boolean) => Promise<ArrayLike<number>>;

const vectorAt = (numbers: ArrayLike<number>, row: number): Vec3 | null => {
  const point: Vec3 = [numbers[3 * row]!, numbers[3 * row + 1]!, numbers[3 * row + 2]!];
  return point.every(Number.isFinite) ? point : null;
};

export class Measures {
  readonly store = new Store<MeasureState>({ list: [], draft: null, tip: null });
  #next = 1;
  #following = false;
  #again = false;
  #adding = Promise.resolve();

  constructor(private readonly history: History, private readonly probe: Probe, private readonly say: (text: string) => void) {}

  /** One more point: the first of `candidates` that lies in the body, else the first of all. Points come in the order of calls. */
  add(kind: MeasureKind, candidates: readonly Vec3[]): Promise<void> {
    this.#adding = this.#adding.then(() => this.#add(kind, candidates)).catch((error: unknown) => {
      this.say(`The point could not be measured: ${wordsOf(error)}`);
    });
    return this.#adding;
  }

  point(tip: Vec3 | null): void {
    if (tip !== this.store.state.tip) this.store.set({ tip });
  }

  /** True where something was being measured. */
  cancel(): boolean {
    if (!this.store.state.draft) return false;
    this.store.set({ draft: null, tip: null });
    return true;
  }

  remove(ids: readonly number[]): void {
    const before = this.store.state.list, after = before.filter(({ id }) => !ids.includes(id));
    if (after.length === before.length) return;
    this.history.run({
      label: before.length - after.length === 1 ? "Remove a measure" : "Remove all measures",
      undo: () => this.#restore(before), redo: () => this.#restore(after),
    });
  }

  /** Of another body. */
  clear(): void {
    this.store.set({ list: [], draft: null, tip: null });
  }

  /** The body has moved: so have the points. One request at a time. */
  async follow(): Promise<void> {
    this.#again = true;
    if (this.#following) return;
    this.#following = true;
    try {
      while (this.#again) {
        this.#again = false;
        const { list, draft } = this.store.state;
        const held = [...list.flatMap(({ points }) => points), ...(draft?.points ?? [])].map(({ rest }) => rest).filter((rest) => rest !== null);
        if (held.length === 0) return;
        const moved = await this.probe(held.flat(), true);
        const places = new Map(held.map((rest, row) => [rest, vectorAt(moved, row)]));
        // What came or went meanwhile is left alone.
        const place = (point: MeasurePoint): MeasurePoint => ({ ...point, posed: (point.rest && places.get(point.rest)) ?? point.posed });
        const now = this.store.state;
        this.store.set({
          list: now.list.map((measure) => ({ ...measure, points: measure.points.map(place) })),
          draft: now.draft && { ...now.draft, points: now.draft.points.map(place) },
        });
      }
    } catch (error) {
      this.say(`Measures do not follow the body: ${wordsOf(error)}`);
    } finally {
      this.#following = false;
    }
  }

  async #add(kind: MeasureKind, candidates: readonly Vec3[]): Promise<void> {
    const scanned = await this.probe(candidates.flat(), false);
    const rests = candidates.map((_, row) => vectorAt(scanned, row));
    const best = Math.max(0, rests.findIndex((rest) => rest !== null));
    const point: MeasurePoint = { posed: candidates[best]!, rest: rests[best]! };
    const { draft } = this.store.state;
    const before = draft?.kind === kind ? draft.points : [];
    // A second click on the same place is a slip, not a length of nothing.
    if (before.length > 0 && length(subtract(before.at(-1)!.posed, point.posed)) < 0.01) return;
    const points = [...before, point];
    if (points.length < pointsOf(kind)) return this.store.set({ draft: { kind, points } });
    const measure: Measure = { id: this.#next++, kind, points };
    this.store.set({ draft: null, tip: null });
    const list = this.store.state.list, after = [...list, measure];
    this.history.run({ label: kind === "distance" ? "Measure a distance" : "Measure an angle", undo: () => this.#restore(list), redo: () => this.#restore(after) });
    this.say(`${kind === "distance" ? "Distance" : "Angle"}: ${spell(kind, valuesOf(measure).posed)}`);
  }

  #restore(list: readonly Measure[]): void {
    this.store.set({ list });
    void this.follow();
  }
}
