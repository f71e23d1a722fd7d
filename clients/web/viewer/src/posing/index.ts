// SPDX-License-Identifier: Apache-2.0
// Posing, wired to the viewer: what the server tells goes into the poser, and what a person does goes out by it.
import type { App } from "../app.js";
import { Role, type Client, type ModelOpened } from "../../../protocol/src/index.js";
import { Store } from "../state/store.js";
import { BodyDrag } from "./body_drag.js";
import { segmentAt, segmentOf } from "./body_map.js";
import { addPoseKeys } from "./keys.js";
import { addLibraryPanel, downloadPose } from "./library_panel.js";
import { addPosePanel, type PoseOptions } from "./pose_panel.js";
import { PoseScene } from "./pose_scene.js";
import { PoseTool, type SegmentUnder } from "./pose_tool.js";
import { Poser } from "./poser.js";
import { poseOf, samePose, restPose } from "./pose.js";
import { rigOf } from "./rig.js";
import { copyLink, presentLink, restoreLink } from "./share.js";
import { Clips } from "./clips.js";
import { addClipsPanel } from "./clips_panel.js";
import { addPeoplePanel, fillStrip } from "./people_panel.js";
import { Together } from "./together.js";
import { h } from "../panels/dom.js";

/** For other parts, the browser's console, and tests. */
export interface Posing {
  readonly poser: Poser;
  readonly drag: BodyDrag;
  readonly scene: PoseScene;
  readonly clips: Clips;
  readonly under: SegmentUnder;
  link(): string;
}

export function addPosing(app: App): Posing {
  const say = (text: string) => app.say(text);
  const client = (): Client => {
    if (!app.live.client) throw new Error("not connected");
    return app.live.client;
  };
  const poser = new Poser(app.history, { setPose: (pose) => client().setPose(pose) }, say);
  const drag = new BodyDrag(poser, { solveIk: (targets, options) => client().solveIk(targets, options) }, say);
  const scene = new PoseScene(app.stage, poser, drag);
  const options = new Store<PoseOptions>({ pulls: false, joints: true });
  const under: SegmentUnder = (row, point) => {
    const tissues = app.store.state.model?.tissues ?? [];
    return segmentAt(tissues[row], point, tissues, app.body, poser.state.rig!, poser.state.motions);
  };
  const together = new Together(say), clips = new Clips(say);
  const strip = h("div", { class: "control-strip" });
  fillStrip(together, strip);
  const tool = new PoseTool(poser, scene, drag, under, () => app.panels.open("pose"));
  app.tools.add(tool);
  options.watch((state) => state.joints, (on) => {
    scene.shown = on;
    app.stage.invalidate();
  });
  addPosePanel(app, poser, drag, options, tool, strip);
  addLibraryPanel(app, poser, () => copyLink(app, poser));
  addClipsPanel(app, poser, clips);
  addPeoplePanel(app, together);
  addPoseKeys(app, poser, options, () => downloadPose(app, poser));
  follow(app, poser, together, clips);
  return { poser, drag, scene, clips, under, link: () => presentLink(app, poser) };
}

/** What the server tells of the pose, and what is chosen elsewhere in the viewer. */
function follow(app: App, poser: Poser, together: Together, clips: Clips): void {
  let digest = 0n;
  let seen: Client | null = null;
  app.live.onOpened(({ client, model }) => {
    if (client !== seen) {
      listen(client, poser, clips);
      together.follow(client);
      clips.follow(client);
    }
    seen = client;
    opened(poser, model, model.rigDigest === digest);
    digest = model.rigDigest;
  });
  app.store.watch((state) => state.model?.controls ?? false, (controls) => poser.control(controls));
  app.live.onBody((first) => first && restoreLink(app, poser));
  addEventListener("hashchange", () => restoreLink(app, poser));
  // A bone that is chosen in the tree or the picture brings up its joint's rings.
  app.store.watch((state) => state.selected, (row) => {
    const { rig } = poser.state;
    const segment = rig && row !== null ? segmentOf(app.store.state.model?.tissues[row]) : null;
    if (rig && segment !== null && rig.segments[segment]!.joint.kind !== "fixed") poser.select(segment);
  });
}

function listen(client: Client, poser: Poser, clips: Clips): void {
  client.on("pose", ({ status, clamped }) => {
    // What a clip asks is nobody's mistake here.
    if ((status?.code ?? 0) === 0) poser.clamped(clips.store.state.now ? [] : clamped);
  });
  client.on("shown", (pose) => poser.observe(pose));
}

/** `again`: the same body, after the server lost this session: what was posed here is posed again. */
function opened(poser: Poser, model: ModelOpened, again: boolean): void {
  if (!model.skeleton) return;
  const before = again ? poser.state.asked : null;
  const rig = rigOf(model.skeleton, model.safeRanges);
  const controls = model.role === Role.CONTROLLER;
  // Older servers do not tell: then a session shows the scan, as a new one does.
  const shown = model.pose ?? { rotation: [] };
  if (before && poser.state.rig && samePose(before, poseOf(rig, shown))) return poser.control(controls);
  poser.open(rig, shown, controls);
  if (before && controls && !samePose(before, restPose(rig))) poser.restore(before);
}
