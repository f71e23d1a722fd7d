// SPDX-License-Identifier: Apache-2.0
// The balls' part of the viewer, wired.
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { download } from "../panels/save.js";
import type { Posing } from "../posing/index.js";
import { moveBack, type Motion } from "../posing/forward.js";
import type { Vec3 } from "../posing/rotation.js";
import { Store } from "../state/store.js";
import { labelOf } from "../state/names.js";
import { BallScene } from "./ball_scene.js";
import { BallTool } from "./ball_tool.js";
import { addBallsPanel, type BallsState } from "./balls_panel.js";
import { aboutJoints, Hanging } from "./hanging.js";
import { writeVtp } from "./vtp.js";

export interface BallsPart {
  readonly hanging: Hanging;
  readonly store: Store<BallsState>;
  readonly scene: BallScene;
}

export function makeBalls(app: App, posing: Posing, content: HTMLElement): BallsPart {
  const client = () => {
    if (!app.live.client) throw new Error("not connected");
    return app.live.client;
  };
  const hanging = new Hanging(app.history, (volume, segment, joints) => client().hangSpheres(volume, segment, joints), (text) => app.say(text));
  const store = new Store<BallsState>({ balls: true, tree: false, joints: true, tool: "off", target: 0 });
  const scene = new BallScene(app.stage), skeleton = () => client().model?.skeleton;
  const motions = (): Motion[] => aboutJoints(posing.poser.state.rig!, hanging.store.state.joints, posing.poser.state.motions);
  const show = () => {
    const { rig } = posing.poser.state, { spheres } = hanging.store.state;
    scene.show(hanging.store.state, rig && spheres ? motions() : [], rig?.segments.map(({ parent }) => parent) ?? []);
  };
  hanging.store.watch((state) => state, show);
  posing.poser.store.watch((state) => state.motions, show);
  store.watch<unknown>((state) => [state.balls, state.tree, state.joints].join(), () => scene.setParts(store.state), true);
  const named = (row: number) => labelOf(skeleton()?.segments[row]?.name ?? String(row));
  const controls = () => app.store.state.model?.controls ?? false;
  const placeJoint = (row: number, place: Vec3) => {
    if (!controls()) return app.say("Only who controls the session may move joints");
    hanging.moveJoint(row, place, named(row));
  };
  app.tools.add(new BallTool(app.stage, scene, {
    chosen: () => (hanging.store.state.spheres ? store.state.tool : "off"),
    pick: (rows, how) => hanging.pick(rows, how),
    moveJoint: (row, posed) => {
      const parent = posing.poser.state.rig!.segments[row]!.parent;
      store.set({ target: row });
      // The root's own slide is taken off.
      const back = parent >= 0 ? moveBack(motions()[parent]!, posed) : moveBack(motions()[row]!, posed);
      placeJoint(row, back);
    },
  }));
  const names = () => skeleton()?.segments.map(({ name }) => name) ?? [];
  const load = async () => {
    if (hanging.store.state.spheres) return hanging.close();
    try {
      const volume = client().model?.volumes[0]?.name;
      if (!volume) return app.say("This model holds no volume");
      hanging.open(volume, await client().spheres(volume));
    } catch (error) {
      app.say(`The balls do not come: ${wordsOf(error)}`);
    }
  };
  const reset = async () => {
    const { volume, spheres } = hanging.store.state;
    if (!volume || !spheres) return;
    try {
      await client().hangSpheres(volume, null, null);
      const { segment, joints } = await client().spheres(volume);
      hanging.reset(segment, joints);
    } catch (error) {
      app.say(`Not changed: ${wordsOf(error)}`);
    }
  };
  const save = () => {
    const { spheres, segment, joints } = hanging.store.state, own = skeleton()?.segments;
    if (!spheres || !own) return;
    const moved = own.some(({ joint }, row) => [joint?.center?.x, joint?.center?.y, joint?.center?.z].some((value, axis) => value !== joints[3 * row + axis]));
    const blob = writeVtp({ ...spheres, segment: segment as Int32Array<ArrayBuffer> }, names(), moved ? joints : null);
    download(blob, `${client().model!.model}_${spheres.name}.vtp`);
    app.say(`Saved ${segment.length} balls`);
  };
  const saveVolume = async () => {
    const { saveVolume: run } = await import("../volume/save_volume.js");
    await hanging.sent();
    await run(app, hanging.store.state.volume!, true);
  };
  addBallsPanel(app, hanging, store, names, { load: () => void load(), reset: () => void reset(), save, saveVolume: () => void saveVolume(), placeJoint: (row, place) => placeJoint(row, place) }, content);
  // The model was read anew, or the server has forgotten the session: what is shown would be another's.
  let identity = client().model?.identity;
  app.live.onOpened(({ model }) => {
    if (hanging.store.state.spheres && model.identity !== identity) hanging.close();
    identity = model.identity;
  });
  const part = { hanging, store, scene };
  // For the browser's console, and for tests.
  Object.assign(window, { ecorcheBalls: part });
  return part;
}
