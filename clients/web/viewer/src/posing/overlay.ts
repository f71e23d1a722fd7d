// SPDX-License-Identifier: Apache-2.0
// Words beside things in the picture: HTML over the canvas, moved with every picture, and never one over another.

import { h, setText } from "../panels/dom.js";

export interface Label {
  readonly text: string;
  /** Pixels of CSS where it belongs; it stands to the right of there, or left where `left`. */
  readonly x: number;
  readonly y: number;
  readonly left: boolean;
  /** For style.css: which ring, and whether it is held. */
  readonly kind: string;
}

const LINE = 26;

export class Overlay {
  readonly root = h("div", { class: "scene-labels", aria: { hidden: true } });
  #made: HTMLElement[] = [];

  show(labels: readonly Label[]): void {
    while (this.#made.length < labels.length) {
      const made = h("div", { class: "scene-label" });
      this.#made.push(made);
      this.root.append(made);
    }
    const placed = apart(labels);
    this.#made.forEach((element, i) => {
      const label = placed[i];
      element.hidden = !label;
      if (!label) return;
      setText(element, label.text);
      element.dataset["kind"] = label.kind;
      element.style.transform = `translate(${Math.round(label.x)}px, ${Math.round(label.y)}px) translate(${label.left ? "calc(-100% - 14px)" : "14px"}, -50%)`;
    });
  }
}

/** Labels of one side that are closer than a line are pushed down, in the order in which they stand. */
export function apart(labels: readonly Label[]): readonly Label[] {
  const out = [...labels];
  for (const left of [true, false]) {
    const order = out.map((_, i) => i).filter((i) => out[i]!.left === left).sort((a, b) => out[a]!.y - out[b]!.y);
    let above = -Infinity;
    for (const i of order) {
      const y = Math.max(out[i]!.y, above + LINE);
      out[i] = { ...out[i]!, y };
      above = y;
    }
  }
  return out;
}
