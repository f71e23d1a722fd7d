// SPDX-License-Identifier: Apache-2.0
// The panel "Library": the poses that come with ecorche, one's own with pictures, files of poses, and the link to what one sees.
import type { App } from "../app.js";
import { h, icon, iconButton } from "../panels/dom.js";
import { download } from "../panels/save.js";
import { labelOf } from "../state/names.js";
import { drawFigure } from "./figure.js";
import type { Poser } from "./poser.js";
import type { Rig } from "./rig.js";
import type { Pose } from "./pose.js";
import { SavedPoses, type SavedPose } from "./saved_poses.js";
import { thumbnail } from "./thumbnail.js";
import { readPose, writePose } from "./pose_yaml.js";
import { wordsOf } from "../errors.js";

const WIDTH = 116, HEIGHT = 132;
const LIBRARY = "M5 4h5v16H5zM10 4h5v16h-5zM15.5 5l4-1 3.2 15-4 1z";
const OPEN = "M3.5 18V6.5h6l2 2.5h9v9zM12 17v-5M9.8 14 12 11.8l2.2 2.2";
const LINK = "M10 14a4 4 0 0 1 0-5.6l2.5-2.5a4 4 0 0 1 5.6 5.6L16.5 13M14 10a4 4 0 0 1 0 5.6l-2.5 2.5a4 4 0 0 1-5.6-5.6L7.5 11";

export function addLibraryPanel(app: App, poser: Poser, copyLink: () => Promise<void>): void {
  app.panels.add({ id: "library", title: "Library", icon: LIBRARY, side: "right", order: 1, mount: (content) => mount(app, poser, copyLink, content) });
  acceptDrops(app, poser);
}

/** Opens the text of a pose file; says what is wrong with it. */
export async function openPose(app: App, poser: Poser, text: string, name: string): Promise<boolean> {
  const { rig } = poser.state;
  if (!rig) return false;
  try {
    const pose = await readPose(text, rig);
    if (!poser.apply(pose, `Open ${name}`)) return false;
    app.say(`Opened ${name}`);
    return true;
  } catch (error) {
    app.say(`${name}: ${wordsOf(error)}`);
    return false;
  }
}

function mount(app: App, poser: Poser, copyLink: () => Promise<void>, content: HTMLElement): void {
  const file = h("input", { type: "file", accept: ".yaml,.yml", hidden: true, id: "pose-file", aria: { label: "A pose file" } });
  file.addEventListener("change", () => {
    const chosen = file.files?.[0];
    if (chosen) void chosen.text().then((text) => openPose(app, poser, text, chosen.name));
    file.value = "";
  });
  const action = (glyph: string, label: string, title: string, run: () => void) =>
    h("button", { type: "button", class: "text-button", title, on: { click: run } }, icon(glyph), label);
  const name = h("input", { type: "text", id: "pose-name", maxLength: 60, autocomplete: "off", placeholder: "Name" });
  const own = h("ul", { class: "poses", aria: { label: "Own poses" } });
  const given = h("ul", { class: "poses", aria: { label: "Poses that come with ecorche" } });
  const none = h("p", { class: "none" }, "Save the present pose, and it stands here with its picture. This browser keeps it.");
  const keep = h("form", { class: "keep" }, h("label", { htmlFor: "pose-name", class: "hidden" }, "Name of the pose"), name,
    h("button", { type: "submit", class: "text-button strong" }, icon("save"), "Save pose"));
  content.append(
    h("div", { class: "scroll-box" },
      keep,
      h("div", { class: "row-of-buttons" },
        action(OPEN, "Open file", "A pose.yaml; one can also drop it on the picture", () => file.click()),
        action("save", "Download", "The present pose as pose.yaml, as `ecorche pose` reads it", () => downloadPose(app, poser)),
        action(LINK, "Copy link", "A link that brings back pose, view and tissues; without the token", () => void copyLink()), file),
      h("h2", { class: "heading" }, "Your own"), none, own, h("h2", { class: "heading" }, "With ecorche"), given),
  );
  let saved: SavedPoses | null = null;
  const list = () => {
    const { rig } = poser.state;
    const all = saved?.list() ?? [];
    none.hidden = all.length > 0;
    own.replaceChildren(...(rig ? all.map((pose) => card(app, poser, pose, () => {
      saved!.remove(pose.name);
      list();
    })) : []));
    name.placeholder = saved?.freeName() ?? "Name";
  };
  keep.addEventListener("submit", (event) => {
    event.preventDefault();
    const { rig, asked } = poser.state;
    if (!rig || !saved) return;
    const pose = { name: name.value.trim() || saved.freeName(), yaml: writePose(asked, rig), picture: thumbnail(app, WIDTH, HEIGHT) };
    try {
      saved.save(pose);
      app.say(`Saved ${pose.name}`);
      name.value = "";
    } catch (error) {
      app.say(`Not saved: ${wordsOf(error)}`);
    }
    list();
  });
  const fill = async (rig: Rig) => {
    const { givenPoses } = await import("./given_poses.js");
    if (poser.state.rig !== rig) return;
    given.replaceChildren(...(await givenPoses(rig)).map((preset) => presetCard(poser, rig, preset.name, preset.pose)));
  };
  // Their parser comes when somebody looks.
  let seen = false;
  const fillSeen = () => {
    const { rig } = poser.state;
    if (rig && seen) void fill(rig).catch((error: unknown) => app.say(`The poses of ecorche did not come: ${String(error)}`));
  };
  new IntersectionObserver((entries, observer) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    observer.disconnect();
    seen = true;
    fillSeen();
  }).observe(keep);
  poser.store.watch((state) => state.rig, (rig) => {
    saved = rig ? new SavedPoses(rig.name, localStorage) : null;
    list();
    given.replaceChildren();
    fillSeen();
  }, true);
  // Figures are drawn in the theme's colours.
  app.store.watch((state) => state.theme, fillSeen);
}

export function downloadPose(app: App, poser: Poser): void {
  const { rig, asked } = poser.state;
  if (!rig) return;
  download(new Blob([writePose(asked, rig)], { type: "application/yaml" }), "pose.yaml");
  app.say("Downloaded pose.yaml");
}

function presetCard(poser: Poser, rig: Rig, name: string, pose: Pose): HTMLLIElement {
  const canvas = h("canvas", { width: WIDTH * 2, height: HEIGHT * 2, aria: { hidden: true } });
  const color = (property: string) => getComputedStyle(document.documentElement).getPropertyValue(property).trim();
  drawFigure(canvas, rig, pose, color("--text"), color("--quiet"));
  const label = labelOf(name);
  return h("li", {}, h("button", { type: "button", class: "pose-card", data: { pose: name }, on: { click: () => poser.apply(pose, `Pose ${label.toLowerCase()}`) } }, canvas, h("span", {}, label)));
}

function card(app: App, poser: Poser, saved: SavedPose, remove: () => void): HTMLLIElement {
  const canvas = h("canvas", { width: WIDTH * 2, height: HEIGHT * 2, aria: { hidden: true } });
  void paintPicture(canvas, saved.picture);
  return h("li", {},
    h("button", { type: "button", class: "pose-card", data: { pose: saved.name }, on: { click: () => void openPose(app, poser, saved.yaml, saved.name) } }, canvas, h("span", {}, saved.name)),
    iconButton("close", `Delete ${saved.name}`, remove));
}

/** Onto a canvas: the page's policy need not allow pictures of addresses that hold their own data. */
async function paintPicture(canvas: HTMLCanvasElement, picture: string): Promise<void> {
  try {
    const bytes = Uint8Array.from(atob(picture), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
    canvas.getContext("2d")!.drawImage(image, 0, 0, canvas.width, canvas.height);
    image.close();
  } catch {
    canvas.classList.add("no-picture");
  }
}

function acceptDrops(app: App, poser: Poser): void {
  const { root } = app.places;
  const carriesFile = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
  root.addEventListener("dragover", (event) => {
    if (!carriesFile(event)) return;
    event.preventDefault();
    root.classList.add("dropping");
  });
  for (const type of ["dragleave", "drop"] as const) root.addEventListener(type, () => root.classList.remove("dropping"));
  root.addEventListener("drop", (event) => {
    const dropped = event.dataTransfer?.files[0];
    if (!dropped) return;
    event.preventDefault();
    void dropped.text().then((text) => openPose(app, poser, text, dropped.name));
  });
}
