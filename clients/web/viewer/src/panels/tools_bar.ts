// SPDX-License-Identifier: Apache-2.0
// Below the picture: views, undo, saving, theme, help. Every button has its key.
import type { App } from "../app.js";
import type { Side } from "../scene/views.js";
import { h, iconButton } from "./dom.js";
import { hideOrShow } from "./chosen.js";
import { popover } from "./popover.js";
import { saveMenu } from "./save.js";
import { nextTheme } from "./theme.js";
import { openHelp } from "./help.js";

const TURN = 10;
const ZOOM = 1.2;

export function addToolsBar(app: App): void {
  const bar = app.places.root.querySelector<HTMLElement>("#tools")!;
  bar.className = "float";
  bar.setAttribute("role", "toolbar");
  bar.setAttribute("aria-label", "View");
  const view = (side: Side, label: string, key: string, word: string) => h("button", {
    type: "button", class: "word-button", title: `${label} (${key})`, on: { click: () => app.fit(side) },
  }, word);
  const undo = iconButton("undo", "Undo", () => app.undo(), "Ctrl+Z"), redo = iconButton("redo", "Redo", () => app.redo(), "Ctrl+Shift+Z");
  const glass = iconButton("glass", "See through the skin", () => app.layers.toggleSeeThrough(), "S");
  const save = iconButton("save", "Save", () => {}, undefined);
  const menu = saveMenu(app);
  popover(save, menu, "Save");
  const divider = () => h("span", { class: "divider" });
  bar.append(
    iconButton("fit", "Fit the body", () => app.fit(), "F"), view("front", "From the front", "1", "Front"),
    view("left", "From the patient's left", "2", "Side"), view("top", "From above", "5", "Top"), glass, divider(),
    undo, redo, divider(), save, iconButton("theme", "Light or dark", () => nextTheme(app), "D"), iconButton("help", "Help and keys", () => openHelp(app), "?"),
    menu,
  );
  const history = () => {
    undo.disabled = app.history.canUndo === null;
    redo.disabled = app.history.canRedo === null;
    undo.title = app.history.canUndo ? `Undo: ${app.history.canUndo} (Ctrl+Z)` : "Undo (Ctrl+Z)";
    redo.title = app.history.canRedo ? `Redo: ${app.history.canRedo} (Ctrl+Shift+Z)` : "Redo (Ctrl+Shift+Z)";
  };
  app.history.onChange(history);
  history();
  app.store.watch((state) => state.seeThrough, (on) => glass.setAttribute("aria-pressed", String(on)), true);
  addViewKeys(app);
}

function addViewKeys(app: App): void {
  const chosen = () => app.store.state.selected !== null;
  const { views } = app;
  app.keys.add(
    { keys: ["f"], label: "Fit the body", group: "View", run: () => app.fit() },
    { keys: ["1"], label: "From the front", group: "View", run: () => app.fit("front") },
    { keys: ["2"], label: "From the patient's left", group: "View", run: () => app.fit("left") },
    { keys: ["3"], label: "From the patient's right", group: "View", run: () => app.fit("right") },
    { keys: ["4"], label: "From behind", group: "View", run: () => app.fit("back") },
    { keys: ["5"], label: "From above", group: "View", run: () => app.fit("top") },
    { keys: ["ArrowLeft"], label: "Turn left", group: "View", run: () => views.turn(-TURN, 0) },
    { keys: ["ArrowRight"], label: "Turn right", group: "View", run: () => views.turn(TURN, 0) },
    { keys: ["ArrowUp"], label: "Turn up", group: "View", run: () => views.turn(0, TURN) },
    { keys: ["ArrowDown"], label: "Turn down", group: "View", run: () => views.turn(0, -TURN) },
    { keys: ["Shift+ArrowLeft"], label: "Move left", group: "View", run: () => views.pan(-1, 0) },
    { keys: ["Shift+ArrowRight"], label: "Move right", group: "View", run: () => views.pan(1, 0) },
    { keys: ["Shift+ArrowUp"], label: "Move up", group: "View", run: () => views.pan(0, 1) },
    { keys: ["Shift+ArrowDown"], label: "Move down", group: "View", run: () => views.pan(0, -1) },
    { keys: ["+", "="], label: "Nearer", group: "View", run: () => views.zoom(1 / ZOOM) },
    { keys: ["-"], label: "Farther", group: "View", run: () => views.zoom(ZOOM) },
    { keys: ["z"], label: "Focus on the chosen tissue", group: "View", run: () => app.focusSelected(), when: chosen },
    { keys: ["/"], label: "Search a tissue", group: "Tissues", run: () => app.panels.open("tissues", true) },
    { keys: ["h"], label: "Hide or show the chosen tissue", group: "Tissues", run: () => hideOrShow(app), when: chosen },
    { keys: ["i"], label: "Show the chosen tissue alone", group: "Tissues", run: () => app.layers.isolate([app.store.state.selected!]), when: chosen },
    { keys: ["a"], label: "Show all tissues", group: "Tissues", run: () => app.layers.showAll() },
    { keys: ["s"], label: "See through the skin", group: "Tissues", run: () => app.layers.toggleSeeThrough() },
    { keys: ["Escape"], label: "Let go, choose nothing", group: "Tissues", run: () => void (app.tools.cancel() || app.select(null)) },
    { keys: ["Ctrl+z"], label: "Undo", group: "General", run: () => app.undo() },
    { keys: ["Ctrl+Shift+z", "Ctrl+y"], label: "Redo", group: "General", run: () => app.redo() },
    { keys: ["p"], label: "Save a picture", group: "General", run: () => void app.savePicture() },
    { keys: ["d"], label: "Light or dark", group: "General", run: () => nextTheme(app) },
    { keys: ["?"], label: "This list", group: "General", run: () => openHelp(app) },
  );
}

