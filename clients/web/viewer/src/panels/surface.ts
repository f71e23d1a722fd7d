// SPDX-License-Identifier: Apache-2.0
// What the surface is coloured by: its tissue, or how far it is from where it was scanned, with a legend in millimetres.
import type { App } from "../app.js";
import { farthestFromRest, niceRange } from "../scene/distance.js";
import type { Scalar } from "../state/app_state.js";
import { h, setText } from "./dom.js";
import { wordsOf } from "../errors.js";

const EVERY_MS = 250;

export function addSurface(app: App, content: HTMLElement): void {
  const select = h("select", { id: "surface" },
    h("option", { value: "none" }, "Tissue colours"), h("option", { value: "distance" }, "Distance from rest"));
  content.append(h("label", { class: "surface" }, h("span", {}, "Surface"), select));
  select.addEventListener("change", () => app.store.set({ scalar: select.value as Scalar }));

  const legend = app.places.root.querySelector<HTMLElement>("#legend")!;
  const most = h("span", {}), now = h("span", {});
  legend.append(h("h2", {}, "Distance from rest"), h("div", { class: "ramp" }), h("div", { class: "ends" }, h("span", {}, "0 mm"), now, most));

  let measured = 0;
  const measure = () => {
    const { rest, positions, topology } = app.body;
    if (!rest || !positions || !topology || app.store.state.scalar !== "distance") return;
    measured = performance.now();
    const farthest = farthestFromRest(positions, rest, topology.ranges);
    const range = niceRange(farthest);
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
  const show = async (scalar: Scalar) => {
    select.value = scalar;
    legend.hidden = scalar !== "distance";
    if (scalar === "distance" && !app.body.rest) {
      try {
        app.body.setRest(await app.live.rest());
      } catch (error) {
        app.store.set({ scalar: "none" });
        app.say(`The scanned body did not come: ${wordsOf(error)}`);
        return;
      }
    }
    app.body.setScalar(app.store.state.scalar === "distance");
    measure();
    app.stage.invalidate();
  };
  app.store.watch((state) => state.scalar, (scalar) => void show(scalar));
  app.live.onTopology(() => void show(app.store.state.scalar));
  app.live.onBody(soon);
}
