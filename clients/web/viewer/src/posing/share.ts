// SPDX-License-Identifier: Apache-2.0
// The link to what one sees, and what such a link brings back.
import type { App } from "../app.js";
import { linkFragment, readLink, type LinkedView } from "./link.js";
import type { Poser } from "./poser.js";

export function presentLink(app: App, poser: Poser): string {
  const { model, layers, seeThrough } = app.store.state;
  const view: LinkedView = {
    pose: poser.state.rig ? poser.state.asked : null,
    camera: app.views.place,
    layers: (model?.tissues ?? []).flatMap(({ row, name }) => {
      const layer = layers[row];
      return layer && (!layer.visible || layer.opacity !== 1) ? [{ name, visible: layer.visible, opacity: layer.opacity }] : [];
    }),
    seeThrough,
  };
  return `${location.origin}${location.pathname}${linkFragment(model?.name ?? "", view)}`;
}

export async function copyLink(app: App, poser: Poser): Promise<void> {
  const link = presentLink(app, poser);
  try {
    await navigator.clipboard.writeText(link);
    app.say("Copied a link to this view. Whoever opens it needs the server's token, too, where it wants one");
  } catch {
    // Without a secure context there is no clipboard: the address itself is then the link.
    history.replaceState(history.state, "", new URL(link).hash);
    app.say("The link is now the address of this page: copy it from there");
  }
}

/** Brings back what the address says; without control of the session all but the pose. */
export function restoreLink(app: App, poser: Poser): void {
  const view = poser.state.rig ? readLink(location.hash)?.(poser.state.rig) : undefined;
  if (!view) return;
  const { model, layers } = app.store.state;
  const named = new Map(view.layers?.map((layer) => [layer.name, layer]));
  const linked = view.layers ? model?.tissues.map(({ row, name }) => {
    const layer = named.get(name);
    return layer ? { visible: layer.visible, opacity: layer.opacity } : { ...layers[row]!, visible: true, opacity: 1 };
  }) : undefined;
  app.store.set({ ...(linked ? { layers: linked } : {}), ...(view.seeThrough === null ? {} : { seeThrough: view.seeThrough }) });
  if (view.pose && poser.state.controls) poser.apply(view.pose, "Pose of the link");
  else if (view.pose) app.say("The link's pose is not shown: another page controls this session");
  if (view.camera) app.views.place = { position: vector(view.camera.position), target: vector(view.camera.target) };
}

const vector = (v: readonly number[]): [number, number, number] => [v[0]!, v[1]!, v[2]!];
