// SPDX-License-Identifier: Apache-2.0
// Keys of posing; the help lists them with all others.
import type { App } from "../app.js";
import type { Store } from "../state/store.js";
import type { PoseOptions } from "./pose_panel.js";
import type { Poser } from "./poser.js";

export function addPoseKeys(app: App, poser: Poser, options: Store<PoseOptions>, download: () => void): void {
  const group = "Posing";
  const chosen = () => poser.state.joint !== null;
  const step = (by: number) => {
    const { rig, joint } = poser.state;
    if (!rig) return;
    const rows = rig.segments.map((_, row) => row).filter((row) => rig.segments[row]!.joint.kind !== "fixed");
    const at = joint === null ? (by > 0 ? -1 : 0) : rows.indexOf(joint);
    poser.select(rows[(at + by + rows.length) % rows.length]!);
  };
  /** The first angle's field of the chosen joint: from there arrows turn it. */
  const fields = () => {
    app.panels.open("pose");
    document.querySelector<HTMLInputElement>(".joint-editor input.number")?.focus();
  };
  app.keys.add(
    { keys: ["]"], label: "Next joint", group, run: () => step(1) },
    { keys: ["["], label: "Joint before", group, run: () => step(-1) },
    { keys: ["e"], label: "Fields of the chosen joint: arrows turn it, Shift by ten degrees", group, run: fields, when: chosen },
    { keys: ["r"], label: "The chosen joint as scanned", group, run: () => poser.reset(poser.state.joint!), when: chosen },
    { keys: ["Shift+r"], label: "All joints as scanned", group, run: () => poser.resetAll() },
    { keys: ["m"], label: "Mirror the pose", group, run: () => poser.mirror() },
    { keys: ["k"], label: "Pin the chosen part, or no more", group, run: () => poser.togglePin(poser.state.joint!), when: chosen },
    { keys: ["g"], label: "Pull the body, or turn the view", group, run: () => options.set({ pulls: !options.state.pulls }) },
    { keys: ["j"], label: "Dots and rings, or none", group, run: () => options.set({ joints: !options.state.joints }) },
    { keys: ["Ctrl+s"], label: "Download the pose", group, run: download },
    { keys: ["Escape"], label: "Choose no joint", group, run: () => poser.select(null), when: () => chosen() && !poser.busy && app.store.state.selected === null },
  );
}
