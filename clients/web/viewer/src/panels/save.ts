// SPDX-License-Identifier: Apache-2.0
// What one takes away: the picture, and the posed tissues that are shown. The writers of meshes are fetched when they are asked for.
import type { App } from "../app.js";
import { shownOpacity } from "../state/layers.js";
import { h, icon } from "./dom.js";
import { wordsOf } from "../errors.js";

export function saveMenu(app: App): HTMLElement {
  const menu = h("div", { class: "menu" });
  const entry = (label: string, ending: string, run: () => Promise<void>) => h("button", {
    type: "button", on: { click: () => { menu.hidePopover(); void run(); } },
  }, icon("save"), label, h("small", {}, ending));
  menu.append(
    entry("Picture of the view", "PNG", () => app.savePicture()),
    entry("Tissues shown, with colours", "GLB", () => saveMeshes(app, "glb")),
    entry("Tissues shown, to print", "STL", () => saveMeshes(app, "stl")),
  );
  let volumes: HTMLElement[] = [];
  app.live.onOpened(({ model }) => {
    for (const button of volumes) button.remove();
    volumes = model.volumes.map(({ name }) => entry(`Posed volume ${name}`, "NIfTI", () => saveVolume(app, name)));
    menu.append(...volumes);
  });
  return menu;
}

async function saveVolume(app: App, name: string): Promise<void> {
  try {
    await (await import("../volume/save_volume.js")).saveVolume(app, name);
  } catch (error) {
    app.say(`${name} was not saved: ${wordsOf(error)}`);
  }
}

async function saveMeshes(app: App, ending: "glb" | "stl"): Promise<void> {
  const { model } = app.store.state;
  const tissues = model?.tissues.filter(({ row }) => shownOpacity(app.store.state, row) > 0) ?? [];
  if (!model || tissues.length === 0) return app.say("Nothing is shown that could be saved");
  try {
    const { meshesOf, writeGlb, writeStl } = await import("../scene/export.js");
    const meshes = meshesOf(app.body, tissues, (row) => shownOpacity(app.store.state, row));
    const blob = ending === "glb" ? await writeGlb(meshes) : writeStl(meshes);
    download(blob, `${fileName(app)}.${ending}`);
    app.say(`Saved ${tissues.length} ${tissues.length === 1 ? "tissue" : "tissues"}`);
  } catch (error) {
    app.say(`Not saved: ${wordsOf(error)}`);
  }
}

export function fileName(app: App): string {
  const { model, poseSequence } = app.store.state;
  return `${model?.name ?? "body"}_pose_${poseSequence}`;
}

export function download(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  h("a", { href: url, download: name }).click();
  // The browser reads it after this turn.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}
