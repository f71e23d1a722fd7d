// SPDX-License-Identifier: Apache-2.0
// The panel "Clips": motion that the server plays, steered here, and recordings of what is posed.
import type { App } from "../app.js";
import { h, icon, iconButton, setText } from "../panels/dom.js";
import { labelOf } from "../state/names.js";
import { positionNow, SPEEDS, type Clips } from "./clips.js";
import type { Poser } from "./poser.js";

const CLIPS = "M3.5 5.5h17v13h-17zM3.5 9h17M7.5 5.5V9M12 5.5V9M16.5 5.5V9M10.5 11.5v4.5l4-2.2z";
const PLAY = "M8 5.5v13l10.5-6.5z", PAUSE = "M8.5 5.5v13M15.5 5.5v13", STOP = "M6.5 6.5h11v11h-11z";
const BACK = "M17 6v12l-8-6zM6.5 6v12", ON = "M7 6v12l8-6zM17.5 6v12";
const RECORD = "M12 18a6 6 0 1 0 0-12 6 6 0 0 0 0 12";

export function addClipsPanel(app: App, poser: Poser, clips: Clips): void {
  app.panels.add({ id: "clips", title: "Clips", icon: CLIPS, side: "right", order: 2, mount: (content) => mount(poser, clips, content) });
  const { store } = clips;
  const playing = () => store.state.now !== null && store.state.steers && poser.state.controls;
  app.keys.add(
    { keys: [" "], label: "Pause the clip, or play on", group: "Clips", run: () => void clips.pause(store.state.now!.playing), when: playing },
    { keys: ["."], label: "One pose on", group: "Clips", run: () => void clips.step(1), when: playing },
    { keys: [","], label: "One pose back", group: "Clips", run: () => void clips.step(-1), when: playing },
  );
}

const time = (seconds: number): string => `${Math.floor(seconds / 60)}:${(seconds % 60).toFixed(2).padStart(5, "0")}`;

function mount(poser: Poser, clips: Clips, content: HTMLElement): void {
  const list = h("ul", { class: "clips", aria: { label: "Clips" } });
  const none = h("p", { class: "none" });
  const toggle = iconButton(PLAY, "Play", () => void clips.pause(clips.store.state.now?.playing ?? false));
  const stop = iconButton(STOP, "Stop", () => void clips.stop());
  const back = iconButton(BACK, "One pose back", () => void clips.step(-1), ","), on = iconButton(ON, "One pose on", () => void clips.step(1), ".");
  const name = h("b", { class: "name" }), clock = h("output", { aria: { live: "off" } });
  const line = h("input", { type: "range", class: "angle-slider", min: "0", step: "any", aria: { label: "Where in the clip, seconds" } });
  let held = false;
  line.addEventListener("input", () => {
    held = true;
    clips.seek(Number(line.value));
  });
  line.addEventListener("change", () => { held = false; });
  const speed = h("select", { id: "clip-speed", on: { change: () => void clips.setSpeed(Number(speed.value)) } },
    ...SPEEDS.map((value) => h("option", { value: String(value) }, `${value}×`)));
  const loop = h("input", { type: "checkbox", id: "clip-loop", on: { change: () => void clips.setLoop(loop.checked) } });
  const player = h("section", { class: "player", aria: { label: "What plays" } },
    h("div", { class: "player-head" }, name, clock), line,
    h("div", { class: "player-buttons" }, back, toggle, on, stop));
  const options = h("div", { class: "line-of-fields" }, h("label", { htmlFor: "clip-speed" }, "Speed"), speed,
    h("label", { class: "inline-check", htmlFor: "clip-loop" }, loop, "Again and again"));
  content.append(h("div", { class: "scroll-box" }, list, none), options, player, recorder(poser, clips));

  const paint = () => {
    const { clips: all, now, steers, offered, speed: chosen, loop: again } = clips.store.state;
    const { controls } = poser.state;
    const key = all.map((clip) => `${clip.name} ${clip.seconds}`).join("\n");
    if (list.dataset["key"] !== key) {
      list.dataset["key"] = key;
      list.replaceChildren(...all.map((clip) => h("li", {}, h("button", { type: "button", class: "clip", data: { clip: clip.name }, on: { click: () => void clips.play(clip.name) } },
        icon(PLAY), h("span", { class: "name" }, labelOf(clip.name)), h("small", {}, `${clip.seconds.toFixed(1)} s`)))));
    }
    for (const button of list.querySelectorAll("button")) {
      button.disabled = !controls;
      button.setAttribute("aria-pressed", String(button.dataset["clip"] === now?.name));
    }
    none.hidden = all.length > 0;
    setText(none, offered ? "No clips fit this body. Start the server with --clips FOLDER, or record one below." : "This server plays no clips.");
    player.hidden = now === null;
    for (const each of [toggle, back, on, line]) each.hidden = !steers;
    for (const each of [toggle, back, on, line, stop, speed, loop]) each.disabled = !controls;
    if (!SPEEDS.some((value) => value === chosen) && !speed.querySelector(`[value="${chosen}"]`)) speed.append(h("option", { value: String(chosen) }, `${chosen}×`));
    speed.value = String(chosen);
    loop.checked = again;
    if (!now) return;
    setText(name, labelOf(now.name));
    line.max = String(now.seconds);
    const label = now.playing ? "Pause" : "Play";
    if (toggle.getAttribute("aria-label") === label) return;
    toggle.setAttribute("aria-label", label);
    toggle.title = `${label} (Space)`;
    toggle.replaceChildren(icon(now.playing ? PAUSE : PLAY));
  };
  // The slider goes on between what the server tells.
  let frame = 0;
  const tick = () => {
    frame = 0;
    const { now } = clips.store.state;
    if (!now) return;
    const at = positionNow(clips.store.state, performance.now());
    if (!held) line.value = String(at);
    setText(clock, `${time(at)} of ${time(now.seconds)}`);
    if (now.playing && !document.hidden) frame = requestAnimationFrame(tick);
  };
  const restart = () => {
    paint();
    cancelAnimationFrame(frame);
    tick();
  };
  clips.store.watch((state) => state, restart, true);
  poser.store.watch((state) => state.controls, paint);
  document.addEventListener("visibilitychange", restart);
}

function recorder(poser: Poser, clips: Clips): HTMLElement {
  const name = h("input", { type: "text", id: "record-name", maxLength: 64, autocomplete: "off", pattern: "[a-z0-9_]{1,64}", title: "Small letters, digits and _", placeholder: "recording_1" });
  const button = h("button", { type: "submit", class: "text-button" }), label = h("span", {}, "Record");
  button.append(icon(RECORD), label);
  const form = h("form", { class: "keep record" }, h("label", { htmlFor: "record-name", class: "hidden" }, "Name of the recording"), name, button);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (clips.store.state.recording !== null) void clips.endRecording();
    else void clips.record(name.value || name.placeholder);
  });
  const paint = () => {
    const { records, recording, clips: all } = clips.store.state;
    form.hidden = !records;
    setText(label, recording === null ? "Record" : "End recording");
    form.dataset["recording"] = String(recording !== null);
    name.disabled = recording !== null || !poser.state.controls;
    button.disabled = !poser.state.controls;
    if (recording !== null) return void (name.value = recording);
    if (all.some((clip) => clip.name === name.value)) name.value = "";
    for (let i = 1; ; i++) {
      if (all.some((clip) => clip.name === `recording_${i}`)) continue;
      name.placeholder = `recording_${i}`;
      break;
    }
  };
  clips.store.watch((state) => state, paint, true);
  poser.store.watch((state) => state.controls, paint);
  return form;
}
