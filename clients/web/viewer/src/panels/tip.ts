// SPDX-License-Identifier: Apache-2.0
// The name of the tissue under the pointer, beside it.
import type { App } from "../app.js";
import { CAP_LABEL } from "../scene/palette.js";
import { h } from "./dom.js";
import { SCALARS } from "./scalars.js";

const OFFSET = 16;

export function addTip(app: App): void {
  const tip = app.places.root.querySelector<HTMLElement>("#tip")!;
  const update = () => {
    const { hovered, model } = app.store.state, shown = app.store.state.scalar;
    const { x, y, scalar, cap, inside } = app.pointer.state;
    const tissue = hovered === null || !inside ? undefined : model?.tissues[hovered];
    tip.hidden = !tissue;
    if (!tissue) return;
    if (cap) tip.replaceChildren(CAP_LABEL, h("small", {}, `no ${tissue.group}`));
    else tip.replaceChildren(tissue.label, h("small", {}, shown === "none" ? tissue.group : SCALARS[shown].say(scalar)));
    const { clientWidth, clientHeight } = app.places.root;
    const left = x + OFFSET + tip.offsetWidth > clientWidth ? x - OFFSET - tip.offsetWidth : x + OFFSET;
    const top = y + OFFSET + tip.offsetHeight > clientHeight ? y - OFFSET - tip.offsetHeight : y + OFFSET;
    tip.style.transform = `translate(${Math.max(0, Math.round(left))}px, ${Math.max(0, Math.round(top))}px)`;
  };
  app.store.watch((state) => state.hovered, update);
  app.pointer.watch((state) => state, update);
}
