// SPDX-License-Identifier: Apache-2.0
// The panel "People": who is in the session, who poses, how others come in. And the strip above the joints that says the same in short.
import type { App } from "../app.js";
import { h, icon, setText } from "../panels/dom.js";
import { ownName, setOwnName, type Person, type Together, type TogetherState } from "./together.js";

const PEOPLE = "M9 11a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7M2.5 20a6.5 6.5 0 0 1 13 0M16 4.5a3.5 3.5 0 0 1 0 6.5M18 14.5a6.5 6.5 0 0 1 3.5 5.5";

/** What the strip says, and what its button does. */
export function standing(state: TogetherState, holder: Person | undefined): { text: string; action: "take" | "ask" | "withdraw" | "give" | null } {
  const asks = state.people.find((person) => person.asks && !person.self);
  if (!state.connected) return { text: "Not connected yet", action: null };
  if (state.controls && asks) return { text: `${asks.name} asks to pose`, action: "give" };
  if (state.controls) return { text: "You pose this body", action: null };
  if (state.asking) return { text: `Asked ${holder ? holder.name : "who poses"}. Waiting`, action: "withdraw" };
  if (state.vacant) return { text: "Nobody poses. You look on", action: "take" };
  if (state.reservedSeconds > 0) return { text: `Kept for who lost the line, ${Math.ceil(state.reservedSeconds)} s at most`, action: null };
  return { text: `${holder ? holder.name : "Another page"} poses. You look on`, action: state.presence ? "ask" : "take" };
}

const ACTIONS = { take: "Take control", ask: "Ask for control", withdraw: "Ask no more", give: "Give control" } as const;

export function fillStrip(together: Together, strip: HTMLElement): void {
  const text = h("p", { role: "status" }), sign = h("span", { class: "contents" });
  const button = h("button", { type: "button", class: "text-button" });
  strip.append(sign, text, button);
  let act: () => void = () => {};
  button.addEventListener("click", () => act());
  together.store.watch((state) => state, (state) => {
    const now = standing(state, together.holder);
    strip.dataset["controls"] = String(state.controls);
    sign.replaceChildren(icon(state.controls ? "pose" : "eye"));
    setText(text, now.text);
    button.hidden = now.action === null;
    if (!now.action) return;
    button.classList.toggle("strong", now.action !== "withdraw");
    setText(button, ACTIONS[now.action]);
    const asks = state.people.find((person) => person.asks && !person.self);
    const runs = { take: () => together.take(), ask: () => together.take(), withdraw: () => together.withdraw(), give: () => (asks ? together.give(asks) : undefined) };
    act = () => void runs[now.action!]();
  }, true);
}

export function addPeoplePanel(app: App, together: Together): void {
  app.panels.add({ id: "people", title: "People", icon: PEOPLE, side: "right", order: 3, mount: (content) => mount(app, together, content) });
}

function mount(app: App, together: Together, content: HTMLElement): void {
  const strip = h("div", { class: "control-strip" });
  fillStrip(together, strip);
  const list = h("ul", { class: "people", aria: { label: "In this session" } });
  const more = h("p", { class: "none", hidden: true });
  const release = h("button", { type: "button", class: "text-button", title: "Whoever takes control next poses", on: { click: () => void together.release() } }, "Give control up");
  const name = h("input", { type: "text", id: "own-name", maxLength: 64, autocomplete: "name", value: ownName(), placeholder: "As others see you" });
  const saved = h("p", { class: "quiet", hidden: true }, "Others see it when this page connects anew: load it again.");
  name.addEventListener("change", () => {
    setOwnName(name.value);
    saved.hidden = false;
  });
  const invite = h("button", { type: "button", class: "text-button", on: { click: () => void copyInvitation(app) } }, icon("live"), "Copy invitation");
  content.append(strip, h("div", { class: "scroll-box" },
    list, more, h("div", { class: "row-of-buttons" }, invite, release),
    h("p", { class: "quiet" }, "Whoever opens the invitation sees this body move, and needs the server's token where it wants one."),
    h("div", { class: "line-of-fields" }, h("label", { htmlFor: "own-name" }, "Your name"), name), saved));
  together.store.watch((state) => state, (state) => {
    release.hidden = !state.controls;
    more.hidden = state.presence && state.others === 0;
    setText(more, state.presence ? `and ${state.others} more` : "This server does not tell who else is here.");
    list.replaceChildren(...state.people.map((person) => line(together, state, person)));
  }, true);
}

function line(together: Together, state: TogetherState, person: Person): HTMLLIElement {
  const gives = state.controls && !person.self && person.takes;
  return h("li", {}, icon(person.controls ? "pose" : "eye"), h("span", { class: "name" }, person.self ? `${person.name} (you)` : person.name),
    h("small", {}, person.controls ? "poses" : person.asks ? "asks to pose" : "looks on"),
    gives && h("button", { type: "button", class: `text-button${person.asks ? " strong" : ""}`, aria: { label: `Give control to ${person.name}` }, on: { click: () => void together.give(person) } }, "Give"));
}

/** An address that opens this session; never with the token. */
async function copyInvitation(app: App): Promise<void> {
  const { model } = app.store.state;
  if (!model) return app.say("No body is open yet");
  const link = `${location.origin}${location.pathname}#${new URLSearchParams({ model: model.name, session: model.session })}`;
  try {
    await navigator.clipboard.writeText(link);
    app.say("Copied the invitation");
  } catch {
    // Without a secure context there is no clipboard.
    history.replaceState(history.state, "", new URL(link).hash);
    app.say("The invitation is now the address of this page: copy it from there");
  }
}
