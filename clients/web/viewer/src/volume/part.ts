// SPDX-License-Identifier: Apache-2.0
// The volume's part of the viewer, wired.
import type { App } from "../app.js";
import { addVolumePanel } from "./volume_panel.js";
import { VolumeView } from "./volume_view.js";

export interface VolumePart {
  readonly view: VolumeView;
}

export function makeVolume(app: App, content: HTMLElement): VolumePart {
  const view = new VolumeView(app), part = { view };
  addVolumePanel(view, content);
  // For the browser's console, and for tests.
  Object.assign(window, { ecorcheVolume: part });
  return part;
}
