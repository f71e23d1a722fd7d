// SPDX-License-Identifier: Apache-2.0
// Which tissues are shown and how strongly, and the steps that change that. Each can be undone.
import type { AppState, Layer } from "./app_state.js";
import type { History } from "./history.js";
import type { Store } from "./store.js";
import { groupLabel } from "./names.js";

/** Of the skin while one looks through it. */
export const SEE_THROUGH = 0.25;

/** What the picture shows of a tissue: 0 is nothing. */
export function shownOpacity(state: AppState, row: number): number {
  const layer = state.layers[row];
  if (!layer) return 0;
  if (state.isolated) return state.isolated.has(row) ? layer.opacity : 0;
  if (!layer.visible) return 0;
  const skin = state.model?.tissues[row]?.group === "skin";
  return state.seeThrough && skin ? Math.min(layer.opacity, SEE_THROUGH) : layer.opacity;
}

type View = Pick<AppState, "layers" | "isolated" | "seeThrough">;

export class Layers {
  constructor(private readonly store: Store<AppState>, private readonly history: History) {}

  /** As other parts save and restore it (links, undo). */
  get view(): View {
    const { layers, isolated, seeThrough } = this.store.state;
    return { layers, isolated, seeThrough };
  }

  setVisible(rows: readonly number[], visible: boolean): void {
    this.#change(`${visible ? "Show" : "Hide"} ${this.#named(rows)}`, { layers: this.#layers(rows, { visible }) });
  }

  setOpacity(rows: readonly number[], opacity: number): void {
    this.#change(`Opacity of ${this.#named(rows)}`, { layers: this.#layers(rows, { opacity }) }, `opacity ${rows.join()}`);
  }

  /** Only these; again with the same ones: all as before. */
  isolate(rows: readonly number[]): void {
    const now = this.store.state.isolated;
    const same = now !== null && now.size === rows.length && rows.every((row) => now.has(row));
    if (same) this.#change("End of isolation", { isolated: null });
    else this.#change(`Isolate ${this.#named(rows)}`, { isolated: new Set(rows) });
  }

  showAll(): void {
    this.#change("Show all", { isolated: null, layers: this.store.state.layers.map(() => ({ visible: true, opacity: 1 })) });
  }

  toggleSeeThrough(): void {
    const on = !this.store.state.seeThrough;
    this.#change(on ? "See through the skin" : "Solid skin", { seeThrough: on });
  }

  /** All at once, as from a link; one step. */
  restore(view: View, label = "Layers"): void {
    this.#change(label, view);
  }

  #layers(rows: readonly number[], patch: Partial<Layer>): readonly Layer[] {
    const chosen = new Set(rows);
    return this.store.state.layers.map((layer, row) => (chosen.has(row) ? { ...layer, ...patch } : layer));
  }

  #named(rows: readonly number[]): string {
    const tissues = rows.map((row) => this.store.state.model?.tissues[row]).filter((tissue) => tissue !== undefined);
    if (tissues.length === 1) return tissues[0]!.label;
    const groups = new Set(tissues.map((tissue) => tissue.group));
    return groups.size === 1 ? groupLabel([...groups][0]!) : `${tissues.length} tissues`;
  }

  #change(label: string, patch: Partial<View>, key?: string): void {
    const before = this.view;
    const after = { ...before, ...patch };
    this.history.run({
      label, ...(key === undefined ? {} : { key }),
      undo: () => this.store.set(before),
      redo: () => this.store.set(after),
    });
  }
}
