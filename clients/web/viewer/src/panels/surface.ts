// SPDX-License-Identifier: Apache-2.0
// What the surface is coloured by: its tissue, how far it is from where it was scanned, its local change of volume, or the weights of a
// segment, with a legend.
import type { App } from "../app.js";
import { farthestFromRest, niceRange } from "../scene/distance.js";
import { labelOf } from "../state/names.js";
import type { Scalar } from "../state/app_state.js";
import { h, setText } from "./dom.js";
import { SCALARS } from "./scalars.js";
import { VertexValues } from "./vertex_values.js";
import { wordsOf } from "../errors.js";

const EVERY_MS = 250;

export function addSurface(app: App, content: HTMLElement): void {
  const kinds = Object.entries(SCALARS) as [Exclude<Scalar, "none">, (typeof SCALARS)["distance"]][];
  const select = h("select", { id: "surface" }, h("option", { value: "none" }, "Tissue colours"), ...kinds.map(([value, { label }]) => h("option", { value }, label)));
  const segment = h("select", { id: "surface-segment", on: { change: () => app.store.set({ weightOf: Number(segment.value) }) } });
  const segmentRow = h("label", { class: "surface", hidden: true }, h("span", {}, "Segment"), segment);
  content.append(h("label", { class: "surface" }, h("span", {}, "Surface"), select), segmentRow);
  select.addEventListener("change", () => app.store.set({ scalar: select.value as Scalar }));
  app.store.watch((state) => state.model?.segments, (names) => {
    segment.replaceChildren(...(names ?? []).map((name, row) => h("option", { value: String(row) }, labelOf(name))));
    segment.value = String(app.store.state.weightOf);
  }, true);

  const legend = app.places.root.querySelector<HTMLElement>("#legend")!;
  const title = h("h2", {}), ramp = h("div", { class: "ramp" }), least = h("span", {}), middle = h("span", {}), most = h("span", {}), now = h("p", { class: "now" });
  legend.append(title, ramp, h("div", { class: "ends" }, least, middle, most), now);

  const values = new VertexValues(app, (low, high) => setText(now, `On this body from ${low.toFixed(2)} to ${high.toFixed(2)}`));
  let measured = 0;
  const measure = () => {
    const { rest, positions, topology } = app.body;
    if (!rest || !positions || !topology || app.store.state.scalar !== "distance") return;
    measured = performance.now();
    const farthest = farthestFromRest(positions, rest, topology.ranges), range = niceRange(farthest);
    app.body.shared.scalarRange.value.set(0, range);
    setText(most, `${range} mm`);
    setText(now, `farthest ${farthest.toFixed(farthest < 10 ? 1 : 0)} mm`);
    app.stage.invalidate();
  };
  let later: ReturnType<typeof setTimeout> | undefined;
  const soon = () => {
    clearTimeout(later);
    const wait = measured + EVERY_MS - performance.now();
    if (wait <= 0) measure();
    else later = setTimeout(measure, wait);
  };
  const head = (scalar: Scalar) => {
    legend.hidden = scalar === "none";
    if (scalar === "none") return;
    const { label, range, ends, middle: between, diverges } = SCALARS[scalar];
    const of = scalar === "weight" ? `Weight of ${labelOf(app.store.state.model?.segments[app.store.state.weightOf] ?? "").toLowerCase()}` : label;
    setText(title, of);
    setText(least, ends[0]);
    setText(middle, between);
    setText(most, ends[1]);
    setText(now, "");
    ramp.dataset["kind"] = diverges ? "diverging" : "rising";
    app.body.shared.scalarDiverges.value = diverges;
    if (range) app.body.shared.scalarRange.value.set(...range);
  };
  const show = async (scalar: Scalar) => {
    select.value = scalar;
    segmentRow.hidden = scalar !== "weight";
    segment.value = String(app.store.state.weightOf);
    head(scalar);
    if (scalar === "distance" && !app.body.rest) {
      try {
        app.body.setRest(await app.live.rest());
      } catch (error) {
        app.store.set({ scalar: "none" });
        app.say(`The scanned body did not come: ${wordsOf(error)}`);
        return;
      }
    }
    // While the numbers come, the tissues' own colours.
    const still = app.store.state.scalar;
    app.body.setScalar(still === "distance" ? "distance" : "none");
    if (still === "det F" || still === "weight") values.show();
    else measure();
    app.stage.invalidate();
  };
  app.store.watch((state) => state.scalar, (scalar) => void show(scalar));
  app.store.watch((state) => state.weightOf, () => void show(app.store.state.scalar));
  app.live.onTopology(() => void show(app.store.state.scalar));
  app.live.onBody(() => {
    soon();
    if (app.store.state.scalar === "det F") values.show();
  });
}
