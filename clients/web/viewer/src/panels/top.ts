// SPDX-License-Identifier: Apache-2.0
// Above the picture: which body it is, how far the pose is to be believed, and how the line is.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import type { LinkState, Quality, Way } from "../state/app_state.js";
import { h, icon, setText } from "./dom.js";
import { popover } from "./popover.js";

export function addTop(app: App): void {
  const top = app.places.root.querySelector("#top")!;
  top.append(title(app), verdict(app), h("div", { class: "space" }), readout(app));
}

function title(app: App): HTMLElement {
  const model = h("span", { class: "model" });
  app.store.watch((state) => state.model?.name, (name) => {
    setText(model, name ?? "");
    document.title = name ? `${name}, ecorche` : "ecorche";
  }, true);
  return h("div", { class: "title float" }, icon("body"), h("b", {}, "ecorche"), model);
}

/** The badge, its figures behind it, and a line that is read out when the verdict turns. */
function verdict(app: App): HTMLElement {
  const mark = h("span", { class: "mark" }), word = h("span", { class: "word" }), pose = h("span", { class: "pose" });
  const figures = h("div", { class: "figures" });
  const said = h("span", { class: "hidden", id: "verdict-said", aria: { live: "polite" } });
  const badge = h("button", { type: "button", class: "verdict float" }, mark, word, pose);
  popover(badge, figures, "Figures of the verdict");
  const update = (quality: Quality | null, before: Quality | null) => {
    badge.hidden = quality === null;
    if (!quality) return;
    const current = quality.poseSequence === app.store.state.poseSequence;
    if (badge.dataset["verdict"] !== quality.verdict) {
      badge.dataset["verdict"] = quality.verdict;
      mark.replaceChildren(icon(quality.verdict === "pass" ? "check" : "warn"));
    }
    setText(word, quality.verdict === "pass" ? "Pass" : "Warn");
    setText(pose, poseName(quality.poseSequence, current));
    if (quality.verdict !== before?.verdict) {
      const over = quality.figures.filter((figure) => figure.over).map((figure) => `${figure.name} ${figure.value}, limit ${figure.limit}`);
      setText(said, `Verdict: ${quality.verdict}${over.length > 0 ? `. ${over.join(". ")}` : ""}`);
    }
    fill(figures, quality);
  };
  let shown: Quality | null = null;
  const both = () => {
    const { quality } = app.store.state;
    update(quality, shown);
    shown = quality;
  };
  app.store.watch((state) => state.quality, both, true);
  app.store.watch((state) => state.poseSequence, both);
  return h("div", {}, badge, figures, said);
}

function poseName(sequence: bigint, current: boolean): string {
  const name = sequence === 0n ? "at rest" : `pose ${sequence}`;
  return current ? name : `${name}, measuring`;
}

function fill(root: HTMLElement, quality: Quality): void {
  const rows = quality.figures.map(({ name, value, limit, over }) => h("tr", { class: over ? "over" : "" },
    h("th", { scope: "row" }, over ? `${name}: too much` : name), h("td", {}, value), h("td", {}, limit)));
  root.replaceChildren(
    h("p", {}, quality.verdict === "pass"
      ? `Of ${poseName(quality.poseSequence, true)}: every figure is within its limit. For training, not for planning surgery.`
      : `Of ${poseName(quality.poseSequence, true)}: do not trust what is marked. For training, not for planning surgery.`),
    h("table", {}, h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Figure"), h("th", { scope: "col" }, "Now"), h("th", { scope: "col" }, "Limit"))),
      h("tbody", {}, ...rows)),
  );
}

const STATES: Record<LinkState, string> = { connecting: "Connecting", open: "Live", reconnecting: "Line lost", closed: "Offline" };

function readout(app: App): HTMLElement {
  const sign = h("span", { class: "sign" }), word = h("span", {});
  const numbers = { fps: h("dd", {}), latency: h("dd", {}), rate: h("dd", {}) };
  const cell = (name: string, value: HTMLElement, label: string) => h("div", { title: label, class: name }, h("dt", {}, unit[name]!), value);
  const unit: Record<string, string> = { fps: "fps", latency: "ms", rate: "" };
  const box = h("div", { class: "readout float", role: "group", aria: { label: "Connection" } },
    h("span", { class: "state" }, sign, word),
    h("dl", {}, cell("fps", numbers.fps, "Frames a second that arrive"), cell("latency", numbers.latency, "There and back to the server, milliseconds"),
      cell("rate", numbers.rate, "What arrives, a second")), arrival(app));
  app.store.watch((state) => state.link, ({ state }) => {
    box.dataset["state"] = state;
    sign.replaceChildren(icon(state === "open" ? "live" : "broken"));
    setText(word, STATES[state]);
  }, true);
  app.store.watch((state) => state.stats, ({ framesPerSecond, bytesPerSecond, latencyMs }) => {
    setText(numbers.fps, framesPerSecond.toFixed(0));
    setText(numbers.latency, Number.isFinite(latencyMs) ? latencyMs.toFixed(latencyMs < 10 ? 1 : 0) : "…");
    setText(numbers.rate, bytesText(bytesPerSecond));
  }, true);
  return box;
}

const WAYS: readonly { way: Way | null; name: string; text: string }[] = [
  { way: null, name: "Chosen by itself", text: "from what arrives: in full at rest, coarser or skinned here where the line is slow" },
  { way: "frames", name: "Frames", text: "the server's own vertices, pose by pose" },
  { way: "skinning", name: "Skinned here", text: "the bones' motions alone, some 2 kB a pose; this device moves the vertices" },
];

/** How the body comes, and a menu to hold one way. */
function arrival(app: App): HTMLElement {
  const word = h("span", {}), how = h("p", { class: "how" });
  const button = h("button", { type: "button", class: "arrival", title: "How the body comes" }, word);
  const choices = WAYS.map(({ way, name, text }) => {
    const input = h("input", { type: "radio", name: "way", value: way ?? "auto", checked: app.live.arrival.way === way });
    input.addEventListener("change", () => app.live.arrival.setWay(way).catch((error: unknown) => app.say(`That way is not to be had: ${wordsOf(error)}`)));
    return h("label", {}, input, h("span", {}, h("b", {}, name), h("span", { class: "text" }, text)));
  });
  const menu = h("div", { class: "ways" }, h("fieldset", {}, h("legend", {}, "How the body comes"), ...choices), how);
  popover(button, menu, "How the body comes");
  app.store.watch((state) => state.stats, ({ level, way }) => {
    const detail = level === 0 ? "full detail" : `1/${4 ** level} detail`;
    setText(word, way === "skinning" ? `${detail}, skinned here` : detail);
    const { skinning } = app.live.stream ?? {};
    setText(how, way === "skinning" && skinning
      ? `Within ${skinning.largestError.toFixed(2)} mm of the server's vertices in ${skinning.measured.length} poses that it measured.` : "");
  }, true);
  return h("div", { class: "arrival-place" }, button, menu);
}

export function bytesText(bytesPerSecond: number): string {
  if (bytesPerSecond < 1e5) return `${(bytesPerSecond / 1e3).toFixed(bytesPerSecond < 1e4 ? 1 : 0)} kB/s`;
  return `${(bytesPerSecond / 1e6).toFixed(bytesPerSecond < 1e7 ? 1 : 0)} MB/s`;
}
