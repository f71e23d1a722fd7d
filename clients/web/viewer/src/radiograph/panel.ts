// SPDX-License-Identifier: Apache-2.0
// The panel of the radiograph: projection, target, distances, both pictures and their window.
import type { App } from "../app.js";
import { h, icon, setText } from "../panels/dom.js";
import { download, fileName } from "../panels/save.js";
import { bodyParts, jointLabel } from "../posing/words.js";
import { numberField } from "../slices/slices_panel.js";
import type { Posing } from "../posing/index.js";
import { LEAST_KEV, MOST_KEV } from "./attenuation.js";
import type { Picture } from "./picture.js";
import { VIEWS } from "./setup.js";
import type { RadiographState } from "./state.js";
import type { XRay } from "./xray.js";

export function addRadiographPanel(app: App, posing: Posing, xray: XRay, content: HTMLElement): void {
  content.append(
    views(xray), target(posing, xray), places(app, xray),
    h("section", { class: "block" }, h("h2", {}, "Live, from the surfaces"), shown(app, xray, xray.live, "live"), note(xray, (s) => s.liveNote)),
    h("section", { class: "block" }, h("h2", {}, "Exact, by the server"), shown(app, xray, xray.exact, "exact"), note(xray, (s) => s.exactNote), exactRow(app, xray)),
    windowRow(xray), checks(xray),
  );
}

const clamped = (value: number, least: number, most: number) => Math.min(most, Math.max(least, value));

function views({ store }: XRay): HTMLElement {
  const buttons = VIEWS.map(({ id, label }) => h("button", {
    type: "button", class: "text-button", data: { view: id }, on: { click: () => store.set({ view: id, turn: 0 }) },
  }, label));
  store.watch((state) => state.view, (view) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset["view"] === view));
  }, true);
  return h("div", { class: "preset-row", role: "group", aria: { label: "Projection" } }, ...buttons);
}

function target(posing: Posing, { store }: XRay): HTMLElement {
  const select = h("select", { id: "radiograph-target", on: { change: () => store.set({ target: select.value === "" ? null : Number(select.value) }) } });
  posing.poser.store.watch((state) => state.rig, (rig) => {
    const groups = rig ? bodyParts(rig).map(({ label, rows }) => {
      const group = h("optgroup", { label });
      group.append(...rows.filter((row) => row > 0).map((row) => h("option", { value: String(row) }, jointLabel(rig.segments[row]!.joint))));
      return group;
    }) : [];
    select.replaceChildren(h("option", { value: "" }, "Middle of the body"), ...groups.filter((group) => group.children.length > 0));
    select.value = store.state.target === null ? "" : String(store.state.target);
  }, true);
  store.watch((state) => state.target, (row) => { select.value = row === null ? "" : String(row); });
  return h("label", { class: "surface plain" }, h("span", {}, "Central ray"), select);
}

function places(_app: App, { store }: XRay): HTMLElement {
  const field = (label: string, unit: string, key: "turn" | "sid" | "width" | "height" | "kev", least: number, most: number) => {
    const made = numberField(label, unit, (value) => {
      store.set({ [key]: clamped(value, least, most) });
      made.show(store.state[key]);
    }, `radiograph-${key}`);
    store.watch((state) => state[key], (value) => made.show(value), true);
    return made.root;
  };
  return h("div", { class: "field-row two" },
    field("Oblique by", "°", "turn", -90, 90), field("Source distance", "mm", "sid", 300, 5000),
    field("Field, width", "mm", "width", 20, 2500), field("Field, height", "mm", "height", 20, 2500),
    field("Energy", "keV", "kev", LEAST_KEV, MOST_KEV));
}

/** A picture whose window is dragged: across its width, up and down its level. */
function shown(app: App, xray: XRay, picture: Picture, kind: "live" | "exact"): HTMLElement {
  const { canvas } = picture;
  canvas.dataset["kind"] = kind;
  let from: { x: number; y: number; level: number; width: number } | null = null;
  canvas.addEventListener("pointerdown", ({ clientX: x, clientY: y, pointerId }) => {
    from = { x, y, ...xray.window };
    canvas.setPointerCapture(pointerId);
  });
  canvas.addEventListener("pointermove", ({ clientX, clientY }) => {
    if (!from) return;
    const per = from.width / Math.max(1, canvas.clientWidth);
    xray.store.set({ window: { width: Math.max(0.05, from.width + per * (clientX - from.x)), level: from.level + per * (clientY - from.y) } });
  });
  for (const end of ["pointerup", "pointercancel"] as const) canvas.addEventListener(end, () => { from = null; });
  canvas.addEventListener("dblclick", () => xray.store.set({ window: null }));
  const save = h("button", { type: "button", class: "text-button", on: { click: () => void savePng(app, picture, kind) } }, icon("save"), "Save as PNG");
  return h("div", { class: "radiograph-box" }, canvas, h("div", { class: "row-of-buttons" }, save));
}

async function savePng(app: App, { canvas, integrals }: Picture, kind: string): Promise<void> {
  if (!integrals) return app.say("There is no picture yet");
  const blob = await new Promise<Blob | null>((resolve) => { canvas.toBlob(resolve, "image/png"); });
  if (!blob) return app.say("The browser made no picture");
  download(blob, `${fileName(app)}_radiograph_${kind}.png`);
}

function note({ store }: XRay, select: (state: RadiographState) => string): HTMLElement {
  const line = h("p", { class: "none", role: "status" });
  store.watch(select, (text) => {
    line.hidden = text === "";
    setText(line, text);
  }, true);
  return line;
}

function exactRow(app: App, xray: XRay): HTMLElement {
  const { store } = xray;
  const ask = h("button", { type: "button", class: "text-button strong", on: { click: () => void xray.ask() } }, "Take it now");
  const stale = h("span", { class: "stale", role: "status" });
  const update = () => {
    const { asking } = store.state, old = xray.exactPose !== null && xray.exactPose !== app.store.state.poseSequence;
    ask.disabled = asking;
    setText(ask, asking ? "Taking it" : "Take it now");
    setText(stale, old && !asking ? "The body has moved since" : "");
    xray.exact.canvas.classList.toggle("old", old);
  };
  store.watch((state) => state.asking, update, true);
  app.store.watch((state) => state.poseSequence, update);
  xray.onPainted(update);
  return h("div", { class: "row-of-buttons" }, ask, stale);
}

function windowRow(xray: XRay): HTMLElement {
  const { store } = xray;
  const set = (change: { level?: number; width?: number }) => store.set({ window: { ...xray.window, ...change } });
  const width = numberField("Width", "", (value) => set({ width: Math.max(0.05, value) }), "radiograph-window-width");
  const level = numberField("Level", "", (value) => set({ level: value }), "radiograph-window-level");
  const fit = h("button", { type: "button", class: "text-button", on: { click: () => store.set({ window: null }) } }, icon("fit"), "Fit");
  const invert = h("input", { type: "checkbox", on: { change: () => store.set({ inverted: invert.checked }) } });
  const update = () => {
    width.show(xray.window.width);
    level.show(xray.window.level);
    fit.setAttribute("aria-pressed", String(store.state.window === null));
  };
  xray.onPainted(update);
  update();
  return h("section", { class: "block" }, h("h2", {}, "Window, of line integrals"), h("div", { class: "field-row two" }, width.root, level.root),
    h("div", { class: "row-of-buttons" }, fit), h("label", { class: "check" }, invert, "Dense is dark, as on film"));
}

function checks({ store }: XRay): HTMLElement {
  const check = (label: string, key: "inScene" | "follows" | "auto") => {
    const input = h("input", { type: "checkbox", id: `radiograph-${key}`, on: { change: () => store.set({ [key]: input.checked }) } });
    store.watch((state) => state[key], (on) => { input.checked = on; }, true);
    return h("label", { class: "check" }, input, label);
  };
  return h("section", { class: "block" }, check("Beam in the scene", "inScene"), check("Source and detector go with the body", "follows"),
    check("The server's picture whenever the body rests", "auto"));
}
