// SPDX-License-Identifier: Apache-2.0
// One stay in a headset: the body on the floor, hands that take hold of it, and the page as it was when one leaves.
import * as THREE from "three";
import type { App } from "../app.js";
import type { Posing } from "../posing/index.js";
import type { Surroundings } from "../scene/stage.js";
import { shownOpacity } from "../state/layers.js";
import { labelOf } from "../state/names.js";
import { levelWithin } from "./detail.js";
import { Grip, type Near } from "./grip.js";
import { Room } from "./room.js";
import { BUTTON, Sources, type Press, type PressKind, type Source } from "./sources.js";
import { Stand } from "./stand.js";
import { Wands } from "./wands.js";
import { Label, Plate } from "./words.js";
import { wordsOf } from "../errors.js";

// A second: by what a stick that is pushed all the way turns and enlarges.
const TURN = Math.PI / 2;
const GROWTH = 2;
// What is within reach is looked for so often, s: it goes over all vertices.
const LOOK_EVERY = 0.12;
const MESSAGE_SECONDS = 4;

export interface Stay {
  /** The room is seen behind the body. */
  readonly inRoom: boolean;
  /** As many as the headset bears. */
  readonly triangles: number;
}

export class Headset {
  /** Once the page is as it was. */
  readonly left: Promise<void>;
  readonly stand: Stand;
  /** All detail, whatever the headset bears. */
  full = false;
  #gone!: () => void;
  #root = new THREE.Group();
  #camera: THREE.PerspectiveCamera;
  #home: THREE.Matrix4;
  #sources: Sources;
  #grip: Grip;
  #wands = new Wands();
  #room: Room;
  #name = new Label();
  #residual = new Label(0.028);
  #message = new Label(0.03);
  #plate = new Plate(0.06);
  #near = new Map<XRInputSource, Near>();
  #named = new THREE.Vector3();
  #placed = false;
  #lookIn = 0;
  #messageLeft = 0;
  #stops: (() => void)[] = [];

  private constructor(private readonly app: App, private readonly posing: Posing, private readonly session: XRSession, private readonly stay: Stay) {
    const { stage, body } = app;
    this.left = new Promise((resolve) => (this.#gone = resolve));
    this.#home = stage.patient.matrix.clone();
    // Hidden tissues count: a skull alone is where the head is, not on the floor.
    const box = body.bounds(app.store.state.model?.tissues.map(({ row }) => row)), size = box.getSize(new THREE.Vector3());
    const foot = box.getCenter(new THREE.Vector3()).setZ(box.min.z).applyMatrix4(this.#home);
    this.stand = new Stand(this.#home, foot);
    // Another than the page's, which the headset would move.
    this.#camera = new THREE.PerspectiveCamera(70, 1, 0.05, 60);
    this.#sources = new Sources(session, () => stage.renderer.xr.getReferenceSpace());
    this.#grip = new Grip(body, stage.patient.matrix, posing.drag, posing.under);
    this.#room = new Room(stage.surroundings, (Math.max(size.x, size.y) / 1000) * 0.9, stay.inRoom);
    this.#camera.add(this.#message.sprite);
    this.#message.at(new THREE.Vector3(0, -0.22, -1));
    this.#root.add(this.#camera, this.#room.group, this.#wands.group, this.#name.sprite, this.#residual.sprite, this.#plate.mesh);
  }

  /** Resolves once pictures are asked for; where that fails the page is as before. */
  static async enter(app: App, posing: Posing, session: XRSession, stay: Stay): Promise<Headset> {
    const headset = new Headset(app, posing, session, stay);
    try {
      await headset.#begin();
    } catch (error) {
      headset.#restore();
      throw error;
    }
    return headset;
  }

  async leave(): Promise<void> {
    await this.session.end();
    await this.left;
  }

  /** The level of detail that is asked for here. */
  get level(): number {
    return this.full ? 0 : levelWithin(this.stay.triangles, this.app.live.stream?.layouts ?? []);
  }

  /** All that is to be read here now. */
  get words(): readonly string[] {
    return [this.#name, this.#residual, this.#message].filter(({ sprite }) => sprite.visible).map(({ text }) => text);
  }

  async #begin(): Promise<void> {
    const { app, posing } = this;
    const { stage } = app;
    posing.scene.shown = false;
    stage.scene.add(this.#root);
    // After the renderer's own listener: then it no longer draws for the headset.
    const ended = () => this.#restore();
    stage.renderer.xr.addEventListener("sessionend", ended);
    this.#stops.push(
      () => stage.renderer.xr.removeEventListener("sessionend", ended),
      app.said.watch((said) => said.count, () => this.#say(app.said.state.text)),
      app.store.watch((state) => state.link, ({ state, reason }) => this.#say(state === "open" ? "The line is back" : `The line is lost: ${reason}`)),
      app.store.watch((state) => state.selected, () => this.#nameChosen()),
      app.store.watch((state) => state.quality, () => this.#tellVerdict(), true),
    );
    await stage.immerse(this.session, {
      camera: this.#camera,
      background: this.stay.inRoom ? null : backgroundOf(stage.surroundings),
      frame: (seconds, frame) => this.#frame(seconds, frame),
    });
    // The view does not wait for it.
    void this.#setLevel();
    this.#say("Squeeze at the body to take hold, point and press to name.\nThe stick turns and enlarges.");
  }

  /** The page as it was. */
  #restore(): void {
    const { app, posing } = this;
    for (const stop of this.#stops.splice(0)) stop();
    if (this.#grip.holder) this.#grip.letGo();
    app.stage.scene.remove(this.#root);
    app.stage.patient.matrix.copy(this.#home);
    app.stage.patient.matrixWorldNeedsUpdate = true;
    this.#wands.dispose();
    for (const words of [this.#name, this.#residual, this.#message, this.#plate]) words.dispose();
    posing.scene.shown = true;
    app.stage.surface();
    app.live.arrival.setLevel(null).catch((error: unknown) => app.say(`Full detail did not come back: ${wordsOf(error)}`));
    this.#gone();
  }

  async #setLevel(): Promise<void> {
    try {
      await this.app.live.arrival.setLevel(this.level);
    } catch (error) {
      this.#say(`Another level of detail did not come: ${wordsOf(error)}`);
    }
  }

  #frame(seconds: number, frame: XRFrame): void {
    const { stage } = this.app;
    const base = stage.renderer.xr.getReferenceSpace();
    const viewer = base && frame.getViewerPose(base);
    if (!base || !viewer) return;
    if (!this.#placed) this.#place(viewer);
    this.#sources.update(frame);
    this.#move(seconds);
    this.stand.matrix(stage.patient.matrix);
    stage.patient.matrixWorldNeedsUpdate = true;
    this.#room.follow(this.stand);
    for (const press of this.#sources.takePresses()) this.#press(press);
    for (const { button } of this.#sources.takeClicks()) this.#click(button);
    this.#carry();
    this.#lookAround(seconds);
    this.#wands.update(this.#sources.all, frame, base, ({ input }) => ({ holds: input === this.#grip.holder, near: this.#near.has(input) }), stage.surroundings.accent);
    this.#label(seconds);
  }

  #place({ transform: { matrix } }: XRViewerPose): void {
    this.#placed = true;
    const eyes = new THREE.Matrix4().fromArray(matrix);
    const at = new THREE.Vector3().setFromMatrixPosition(eyes);
    this.stand.before(at, new THREE.Vector3(0, 0, -1).transformDirection(eyes));
    // At the feet, read from where one stands.
    const towards = at.setY(0).sub(this.stand.position).setLength(0.45);
    this.#plate.mesh.position.copy(this.stand.position).add(towards).setY(0.006);
    this.#plate.mesh.rotation.y = this.stand.yaw;
  }

  #move(seconds: number): void {
    const { x, y } = this.#sources.stick;
    if (x) this.stand.turn(x * TURN * seconds);
    if (y) this.stand.resize(GROWTH ** (y * seconds));
  }

  #carry(): void {
    const { holder } = this.#grip;
    if (!holder) return;
    const source = this.#sources.all.find(({ input }) => input === holder);
    if (source?.hold) this.#grip.carry(source.hold);
    // A controller that was switched off lets go; one that is only out of sight does not.
    else if (!source) this.#grip.letGo();
  }

  #press({ kind, down, source }: Press): void {
    if (!down) {
      if (this.#grip.holder === source.input && this.#grip.kind === kind) this.#grip.letGo();
      return;
    }
    const near = source.hold && this.#grip.near(source.hold, this.#shownRows());
    // Hands have no squeeze: with them one takes between thumb and finger.
    if (near && (kind === "squeeze" || source.isHand)) return this.#take(source, kind, near);
    if (kind === "select") return this.#choose(source);
    if (source.hold) this.#say("Nothing is within reach: bring the hand to the body, then squeeze");
  }

  #take(source: Source, kind: PressKind, near: Near): void {
    if (this.#grip.holder) return this.#say("One part at a time: let go of the other first");
    if (!this.#grip.take(source.input, kind, near)) return;
    pulse(source.input.gamepad);
  }

  #choose({ ray }: Source): void {
    const picked = ray && this.app.picker.pickAlong(ray);
    if (picked) this.#named.copy(picked.point);
    this.app.select(picked?.row ?? null);
  }

  #click(button: number): void {
    if (button === BUTTON.lower) this.app.undo();
    if (button === BUTTON.upper) this.app.redo();
    if (button !== BUTTON.stick) return;
    this.full = !this.full;
    this.#say(this.full ? "Full detail" : "Coarser, for an even rate");
    void this.#setLevel();
  }

  #lookAround(seconds: number): void {
    this.#lookIn -= seconds;
    if (this.#lookIn > 0) return;
    this.#lookIn = LOOK_EVERY;
    this.#near.clear();
    if (this.#grip.holder) return;
    const rows = this.#shownRows();
    for (const { input, hold } of this.#sources.all) {
      const near = hold && this.#grip.near(hold, rows);
      if (near) this.#near.set(input, near);
    }
  }

  /** The chosen tissue's name where it was pointed at, how far a pull is from its goal, and what was said. */
  #label(seconds: number): void {
    const { patient } = this.app.stage;
    this.#name.at(this.#named.clone().applyMatrix4(patient.matrix));
    this.#residual.show(this.#reachText());
    this.#messageLeft -= seconds;
    if (this.#messageLeft <= 0) this.#message.show("");
  }

  #reachText(): string {
    const { pull } = this.posing.drag.store.state;
    const { rig } = this.posing.poser.state;
    const { patient } = this.app.stage;
    if (pull && rig) {
      this.#residual.at(new THREE.Vector3(...pull.target).applyMatrix4(patient.matrix).add(new THREE.Vector3(0, 0.07, 0)));
      const name = labelOf(rig.segments[pull.segment]!.name);
      return pull.residual < 1 ? name : `${name}: ${Math.round(pull.residual)} mm short`;
    }
    const [input, near] = [...this.#near][0] ?? [];
    const hold = this.#sources.all.find((source) => source.input === input)?.hold;
    if (!near || !hold || !rig) return "";
    this.#residual.at(hold.clone().add(new THREE.Vector3(0, 0.07, 0)));
    return `Take: ${labelOf(rig.segments[near.segment]!.name)}`;
  }

  #nameChosen(): void {
    const { selected, model } = this.app.store.state;
    this.#name.show(selected === null ? "" : model?.tissues[selected]?.label ?? "");
  }

  #tellVerdict(): void {
    const { quality } = this.app.store.state;
    const over = quality?.figures.filter((figure) => figure.over).map(({ name, value, limit }) => `${name}: ${value}, limit ${limit}`) ?? [];
    this.#plate.show(["For training, not for planning surgery", ...(quality ? [`Verdict: ${quality.verdict}`] : []), ...over.slice(0, 2)].join("\n"));
  }

  #say(text: string): void {
    this.#message.show(text);
    this.#messageLeft = MESSAGE_SECONDS;
  }

  #shownRows(): readonly number[] {
    const { state } = this.app.store;
    return (state.model?.tissues ?? []).map(({ row }) => row).filter((row) => shownOpacity(state, row) > 0);
  }
}

/** Darker than the page: all round the eyes a light wall dazzles, and bone would not stand out from it. */
const backgroundOf = ({ below, shadow }: Surroundings): THREE.Color => new THREE.Color(below).lerp(new THREE.Color(shadow), 0.6);

/** Felt in the hand, where the browser can. */
function pulse(gamepad: Gamepad | undefined): void {
  const [actuator] = (gamepad as { hapticActuators?: readonly { pulse?(strength: number, ms: number): Promise<unknown> }[] } | undefined)?.hapticActuators ?? [];
  actuator?.pulse?.(0.4, 30).catch(() => {});
}
