// SPDX-License-Identifier: Apache-2.0
// The radiograph, wired: where source and detector stand, the live picture of the surfaces as the body moves, and the server's when it
// rests.
import * as THREE from "three";
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import type { Posing } from "../posing/index.js";
import { move } from "../posing/forward.js";
import { IDENTITY, type Quat, type Vec3 } from "../posing/rotation.js";
import { jointLabel } from "../posing/words.js";
import { Store } from "../state/store.js";
import { Code, ServerError } from "../../../protocol/src/index.js";
import { beyondSoft } from "./attenuation.js";
import { BeamScene } from "./beam_scene.js";
import { LivePicture, type Attenuating } from "./live.js";
import { fitWindow, Picture, type Integrals, type Marks } from "./picture.js";
import { axesOf, markerOf, placed, projectionName, type Setup } from "./setup.js";
import { firstRadiograph, type RadiographState } from "./state.js";

const REST_MS = 300;
// Pixels along the longer side.
const LIVE = 384;
const EXACT = 512;
/** Flesh about the bones of a joint, mm. */
const FLESH = 60;

export class XRay {
  readonly store = new Store<RadiographState>(firstRadiograph());
  readonly live = new Picture("Radiograph of the surfaces, live");
  readonly exact = new Picture("Radiograph by the server");
  readonly renderer: LivePicture;
  /** The pose that the server's picture shows; null: there is none. */
  exactPose: bigint | null = null;
  #beam: BeamScene;
  #shown = false;
  #drawing = false;
  #again = false;
  #behind = 0;
  #rest: ReturnType<typeof setTimeout> | undefined;
  #asked: { setup: Setup; pose: bigint } | null = null;
  #listeners = new Set<() => void>();

  constructor(private readonly app: App, private readonly posing: Posing) {
    this.renderer = new LivePicture(app.stage.renderer);
    this.#beam = new BeamScene(app.stage);
    const { store } = this;
    store.set({ liveNote: this.renderer.support.missing });
    for (const select of [
      (s: RadiographState) => s.view, (s: RadiographState) => s.turn, (s: RadiographState) => s.target, (s: RadiographState) => s.sid,
      (s: RadiographState) => s.width, (s: RadiographState) => s.height,
    ]) store.watch<unknown>(select, () => this.aim());
    store.watch((state) => state.follows, (follows) => follows && this.aim());
    store.watch((state) => state.kev, () => this.#changed());
    store.watch((state) => state.auto, () => this.#changed());
    store.watch((state) => state.inScene, () => this.#showBeam());
    store.watch((state) => state.window, () => this.#paint());
    store.watch((state) => state.inverted, () => this.#paint());
    app.live.onBody(() => this.#bodyMoved());
    app.live.onTopology(() => this.#changed());
    app.live.onOpened(() => {
      this.exactPose = this.#asked = this.exact.integrals = null;
      this.#surfaces = false;
      store.set({ target: null, exactNote: "" });
      this.#paint();
    });
  }

  /** The panel is seen, or no more: what nobody sees is not made. */
  show(on: boolean): void {
    this.#shown = on;
    if (on) this.aim();
    else this.#showBeam();
  }

  /** Called after a picture changed. */
  onPainted(listener: () => void): void {
    this.#listeners.add(listener);
  }

  /** The setup anew, for the body as it is now. */
  aim(): void {
    const { rig } = this.posing.poser.state;
    if (!this.#shown || !rig || !this.app.body.positions) return;
    const target = this.#target();
    this.#behind = this.#reach(target);
    this.#place(target);
  }

  /** The server's picture of this setup. */
  async ask(): Promise<void> {
    const { client } = this.app.live, { setup, kev, asking } = this.store.state;
    if (!client || !setup || asking) return;
    const pose = this.app.store.state.poseSequence;
    let again = false;
    this.store.set({ asking: true });
    this.#asked = { setup, pose };
    try {
      const { message, picture } = await client.radiograph({
        placed: {
          source: vector(setup.source), detector: vector(setup.detector.centre), right: vector(setup.detector.right), down: vector(setup.detector.down),
        },
        width: setup.detector.width, height: setup.detector.height, ...pixels(setup, EXACT), energy: kev,
        surfaces: this.#surfaces,
      });
      this.exactPose = message.poseSequence;
      const volume = message.volume === undefined ? "surfaces" : client.model?.volumes[message.volume]?.name ?? "volume";
      this.#take(this.exact, { values: picture as Float32Array, columns: message.columns, rows: message.rows },
        this.#marks(setup, `Server, ${volume}, pose ${message.poseSequence}`));
      const through = this.#surfaces ? "This model holds no CT: the server looks through its surfaces." : "";
      this.store.set({ exactNote: message.largest > 0 ? through : "Nothing stands between source and detector." });
    } catch (error) {
      again = this.#refused(error);
    } finally {
      this.store.set({ asking: false });
    }
    if (again) return this.ask();
    if (this.#stale) this.#soon();
  }
  #surfaces = false;

  /** A model without a scan: the server looks through its surfaces from now on, and the panel says so. */
  #refused(error: unknown): boolean {
    if (!this.#surfaces && error instanceof ServerError && error.code === Code.FAILED_PRECONDITION) {
      this.#surfaces = true;
      return true;
    }
    this.store.set({ exactNote: `The server made no picture: ${wordsOf(error)}` });
    return false;
  }

  get #stale(): boolean {
    const { setup } = this.store.state;
    return !this.#asked || this.#asked.setup !== setup || this.#asked.pose !== this.app.store.state.poseSequence;
  }

  /** Both pictures are of the present pose and setup. */
  get settled(): boolean {
    return !this.#drawing && !this.store.state.asking && !this.#stale;
  }

  get root(): Quat {
    return this.posing.poser.state.motions[0]?.q ?? IDENTITY;
  }

  #bodyMoved(): void {
    if (!this.#shown) return;
    if (!this.store.state.setup) return this.aim();
    if (this.store.state.follows) this.#place(this.#target());
    else this.#changed();
  }

  #place(target: Vec3): void {
    this.store.set({ setup: placed(this.store.state, this.root, target, this.#behind) });
    this.#showBeam();
    this.#changed();
  }

  /** Posed place of what the central ray meets. */
  #target(): Vec3 {
    const { rig, motions } = this.posing.poser.state, row = this.store.state.target;
    const segment = row === null ? undefined : rig?.segments[row];
    if (segment && motions[row!]) return move(motions[row!]!, segment.joint.center);
    const middle = this.app.body.bounds(this.#rows(null)).getCenter(new THREE.Vector3());
    return [middle.x, middle.y, middle.z];
  }

  /** Of all tissues, or of the bones on both sides of a joint. */
  #rows(joint: number | null): number[] {
    const tissues = this.app.store.state.model?.tissues ?? [], all = tissues.map(({ row }) => row);
    if (joint === null) return all;
    const parent = this.posing.poser.state.rig?.segments[joint]?.parent ?? -1;
    return tissues.filter(({ segment }) => segment === joint || (segment >= 0 && segment === parent)).map(({ row }) => row);
  }

  /** How far what hangs on the target reaches along the beam. */
  #reach(target: Vec3): number {
    const joint = this.store.state.target, rows = this.#rows(joint);
    const box = this.app.body.bounds(rows.length > 0 ? rows : this.#rows(null));
    const { beam } = axesOf(this.store.state, this.root);
    const most = [0, 1, 2].reduce((sum, axis) => sum + Math.max(
      beam[axis]! * (box.min.getComponent(axis) - target[axis]!), beam[axis]! * (box.max.getComponent(axis) - target[axis]!)), 0);
    const behind = Math.max(0, most) + (joint === null ? 0 : FLESH);
    // The source stands before the target, whatever lies behind it.
    return Math.min(behind, Math.max(0, this.store.state.sid - 120));
  }

  #changed(): void {
    if (!this.#shown) return;
    void this.#drawLive();
    this.#soon();
    for (const listener of this.#listeners) listener();
  }

  #soon(): void {
    clearTimeout(this.#rest);
    if (this.store.state.auto && this.#shown) this.#rest = setTimeout(() => void this.ask(), REST_MS);
  }

  async #drawLive(): Promise<void> {
    this.#again = true;
    if (this.#drawing || this.renderer.support.type === null) return;
    this.#drawing = true;
    try {
      while (this.#again) {
        this.#again = false;
        const { setup } = this.store.state, tissues = this.#attenuating();
        if (!setup || !tissues || this.app.stage.immersed) break;
        const { columns, rows } = pixels(setup, LIVE);
        const pose = this.app.store.state.poseSequence;
        const values = await this.renderer.render(this.app.body, tissues, setup, columns, rows);
        this.#take(this.live, { values, columns, rows }, this.#marks(setup, `Live, surfaces, pose ${pose}`));
      }
    } catch (error) {
      this.store.set({ liveNote: `There is no live picture: ${wordsOf(error)}` });
    } finally {
      this.#drawing = false;
    }
  }

  /** Null: none can be drawn, and why stands beside it. */
  #attenuating(): Attenuating[] | null {
    const { model } = this.app.store.state, open = new Set<number>();
    for (const { tissue, share } of this.app.live.frame?.quality?.tissues ?? []) if (share === undefined) open.add(tissue);
    if (!model) return null;
    if (model.tissues.some(({ row, group }) => group === "skin" && open.has(row))) {
      this.store.set({ liveNote: "The skin is not closed: there is no live picture. `ecorche repair` closes it." });
      return null;
    }
    return model.tissues.filter(({ row }) => !open.has(row))
      .map(({ row, name, group }) => ({ row, attenuation: beyondSoft(name, group, this.store.state.kev) }));
  }

  #marks(setup: Setup, what: string): Marks {
    const { sid, kev, target } = this.store.state, { rig } = this.posing.poser.state;
    const joint = target === null ? undefined : rig?.segments[target]?.joint;
    return {
      marker: markerOf(setup, this.root), projection: `${projectionName(this.store.state)}, ${joint ? jointLabel(joint).toLowerCase() : "body"}`,
      what: `${this.app.store.state.model?.name ?? ""}: ${what}`, facts: `${Math.round(kev)} keV, ${Math.round(sid)} mm`,
    };
  }

  #take(picture: Picture, integrals: Integrals, marks: Marks): void {
    picture.integrals = integrals;
    picture.marks = marks;
    this.#paint();
  }

  /** Both by one window, so that they can be compared. */
  get window() {
    const { window } = this.store.state, fitted = this.exact.integrals ?? this.live.integrals;
    return window ?? (fitted ? fitWindow(fitted) : { level: 2, width: 4 });
  }

  #paint(): void {
    const { window } = this;
    for (const picture of [this.live, this.exact]) picture.draw(window, this.store.state.inverted);
    for (const listener of this.#listeners) listener();
  }

  #showBeam(): void {
    const { setup, inScene } = this.store.state;
    this.#beam.show(this.#shown && inScene ? setup : null);
  }
}

const vector = ([x, y, z]: Vec3) => ({ x, y, z });

/** As wide as high: the longer side has `most`. */
export function pixels({ detector: { width, height } }: Setup, most: number): { columns: number; rows: number } {
  const side = Math.max(width, height);
  return { columns: Math.max(1, Math.round((most * width) / side)), rows: Math.max(1, Math.round((most * height) / side)) };
}
