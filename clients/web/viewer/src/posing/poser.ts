// SPDX-License-Identifier: Apache-2.0
// The pose as it is asked for, who may change it, and every way to change it: undone and redone with all else that a person does.

import type { Pose as ClientPose } from "../../../protocol/src/index.js";
import type { History } from "../state/history.js";
import { Store } from "../state/store.js";
import { anglesWithin, constrain, setAngle } from "./angles.js";
import { forward, move, type Motion } from "./forward.js";
import { counterpart, mirrorJoint, mirrorPose } from "./mirror.js";
import { poseOf, restPose, samePose, withRotation, withTranslation, wireOf, type Pose, type WirePose } from "./pose.js";
import type { Rig } from "./rig.js";
import { DEGREES, IDENTITY, ORIGIN, type Vec3 } from "./rotation.js";
import { angleLabel, degreesText, jointLabel, spoken } from "./words.js";

/** A point of the body that stays where it is while another one is dragged. */
export interface Pin {
  readonly segment: number;
  /** Its joint, and the joints that it carries, which hold how it stands: on the scanned body, and where they stay; mm, LPS. */
  readonly points: readonly { readonly rest: Vec3; readonly place: Vec3 }[];
}

/** A joint that was asked for more than it can do. */
export interface Held {
  readonly row: number;
  readonly text: string;
}

export interface PosingState {
  readonly rig: Rig | null;
  /** What the next change starts from. */
  readonly asked: Pose;
  /** As the body does it: after limits and couplings. */
  readonly body: Pose;
  /** Of the segments, in `body`. */
  readonly motions: readonly Motion[];
  /** Row of the joint whose rings are shown. */
  readonly joint: number | null;
  /** Whether poses of this page are taken. */
  readonly controls: boolean;
  readonly pins: readonly Pin[];
  readonly held: readonly Held[];
}

export interface PoseSink {
  setPose(pose: ClientPose): void;
}

const EMPTY: Pose = { rootTranslation: ORIGIN, rotation: [], translation: [] };

export class Poser {
  readonly store = new Store<PosingState>({
    rig: null, asked: EMPTY, body: EMPTY, motions: [], joint: null, controls: false, pins: [], held: [],
  });
  #gesture: Pose | null = null;

  constructor(private readonly history: History, private readonly sink: PoseSink, private readonly say: (text: string) => void) {}

  get state(): Readonly<PosingState> {
    return this.store.state;
  }

  /** Another body, in the pose that its session shows. */
  open(rig: Rig, shown: WirePose, controls: boolean): void {
    this.#gesture = null;
    this.store.set({ rig, joint: null, pins: [], held: [], controls, ...this.#of(rig, poseOf(rig, shown)) });
  }

  /** A pose that somebody else showed: a clip, another page, or this one in another life. */
  observe(shown: WirePose): void {
    const { rig } = this.state;
    if (!rig || this.#gesture) return;
    const asked = poseOf(rig, shown);
    if (!samePose(asked, this.state.asked)) this.store.set(this.#of(rig, asked));
  }

  /** The server lost what was posed here: once more, and no step to undo. */
  restore(pose: Pose): void {
    if (this.state.controls) this.#put(pose);
  }

  control(controls: boolean): void {
    if (controls === this.state.controls) return;
    if (!controls) this.#gesture = null;
    this.store.set({ controls });
  }

  select(joint: number | null): void {
    if (joint !== this.state.joint) this.store.set({ joint });
  }

  /** What the server took away from the pose, as PoseAck and frames tell. */
  clamped(joints: readonly { joint: number; removed: number }[]): void {
    const { rig } = this.state;
    if (!rig) return;
    const held = joints.filter(({ joint }) => rig.segments[joint]).map(({ joint, removed }) => ({
      row: joint, text: `${jointLabel(rig.segments[joint]!.joint)} is at its limit: ${degreesText(removed)} of what was asked is left out`,
    }));
    // A stop that was told here already is still told: the next change takes it away.
    if (held.length === 0) return;
    if (held.map((h) => h.row).join() !== this.state.held.map((h) => h.row).join()) this.say(held[0]!.text);
    this.store.set({ held });
  }

  /** Radians, as the body does it. */
  angle(row: number, angle: number): number {
    const { rig, body } = this.state;
    return anglesWithin(rig!.segments[row]!.joint, body.rotation[row]!)[angle]!;
  }

  // ---- Gestures: many poses, one step to undo.

  /** False where poses are not taken; says why. */
  begin(): boolean {
    if (!this.#may()) return false;
    this.#gesture = this.state.asked;
    return true;
  }

  get busy(): boolean {
    return this.#gesture !== null;
  }

  /** Shows a pose of the gesture; `sent`: the server has it already. */
  show(pose: Pose, sent = false): void {
    if (!this.#gesture) return;
    this.#put(pose, sent);
  }

  commit(label: string): void {
    const before = this.#gesture;
    this.#gesture = null;
    if (before) this.#remember(before, label);
  }

  cancel(): void {
    const before = this.#gesture;
    this.#gesture = null;
    if (before) this.#put(before);
  }

  // ---- Single steps.

  /** Steps of one `key` that follow soon are one to undo. */
  apply(pose: Pose, label: string, key?: string): boolean {
    if (!this.#may()) return false;
    const before = this.#gesture ?? this.state.asked;
    this.#gesture = null;
    this.#put(pose);
    this.#remember(before, label, key);
    return true;
  }

  /** Sets an anatomical angle, radians. Returns what became of it; null where poses are not taken. */
  turn(row: number, angle: number, value: number): number | null {
    const { rig, body } = this.state;
    if (!rig) return null;
    const { joint } = rig.segments[row]!;
    const set = setAngle(joint, body.rotation[row]!, angle, value);
    const { name } = joint.sequence[angle]!;
    if (!this.apply(withRotation(this.state.asked, row, set.rotation), `${jointLabel(joint)}: ${spoken(name, set.value)}`, `${row}.${angle}`)) return null;
    if (set.limit !== null) this.sayLimit(row, angle, set.limit);
    return set.value;
  }

  /** An angle that stands at its limit; `aloud`: where it came there just now. */
  sayLimit(row: number, angle: number, limit: number, aloud = true): void {
    const { joint } = this.state.rig!.segments[row]!;
    const text = `${jointLabel(joint)}: ${angleLabel(joint.sequence[angle]!.name).toLowerCase()} stops at ${degreesText(limit)}, its limit`;
    if (aloud) this.say(text);
    this.store.set({ held: [{ row, text }] });
  }

  /** Moves the whole body, or a joint that slides, along an axis; mm. */
  slide(row: number, axis: number, value: number): void {
    const { rig, asked } = this.state;
    if (!rig) return;
    const from = row === 0 ? asked.rootTranslation : asked.translation[row]!;
    const to = from.map((x, i) => (i === axis ? Math.min(Math.max(value, -1e6), 1e6) : x)) as unknown as Vec3;
    this.apply(withTranslation(asked, row, to), `Move ${jointLabel(rig.segments[row]!.joint).toLowerCase()}`, `${row}.move${axis}`);
  }

  reset(row: number): void {
    const { rig, asked } = this.state;
    if (!rig) return;
    const back = withTranslation(withRotation(asked, row, IDENTITY), row, ORIGIN);
    this.apply(back, `${jointLabel(rig.segments[row]!.joint)} as scanned`);
  }

  resetAll(): void {
    const { rig } = this.state;
    if (rig) this.apply(restPose(rig), "All joints as scanned");
  }

  /** Left and right exchanged. */
  mirror(): void {
    const { rig, asked } = this.state;
    if (rig) this.apply(mirrorPose(rig, asked), "Mirror the pose");
  }

  /** The joint on the other side turns as this one does. */
  mirrorTo(row: number): void {
    const { rig, body, asked } = this.state;
    const other = rig && mirrorJoint(rig, body, row);
    if (other) this.apply(withRotation(asked, other.row, other.rotation), `${jointLabel(rig.segments[other.row]!.joint)} as the other side`);
  }

  hasOtherSide(row: number): boolean {
    const { rig } = this.state;
    const other = rig ? counterpart(rig, row) : -1;
    return other >= 0 && other !== row;
  }

  /** A segment stays where it is while others are pulled, or no more. */
  togglePin(segment: number): void {
    const { rig, pins, motions } = this.state;
    if (!rig || segment === 0) return;
    const others = pins.filter((pin) => pin.segment !== segment);
    if (others.length === pins.length) {
      const carried = rig.segments.filter((s, row) => row === segment || s.parent === segment).map((s) => s.joint.center);
      others.push({ segment, points: carried.map((rest) => ({ rest, place: move(motions[segment]!, rest) })) });
    }
    this.store.set({ pins: others });
  }

  #may(): boolean {
    const { rig, controls } = this.state;
    if (rig && controls) return true;
    this.say(rig ? "You are looking on: take control to pose" : "No body is open yet");
    return false;
  }

  #remember(before: Pose, label: string, key?: string): void {
    const after = this.state.asked;
    if (samePose(before, after)) return;
    const { rig } = this.state;
    // After another model came a pose of the old one means nothing.
    const go = (pose: Pose) => {
      if (this.state.rig === rig && this.#may()) this.#put(pose);
    };
    this.history.push({ label, undo: () => go(before), redo: () => go(after), ...(key === undefined ? {} : { key: `pose.${key}` }) });
  }

  #put(asked: Pose, sent = false): void {
    const { rig } = this.state;
    if (!rig) return;
    this.store.set({ held: [], ...this.#of(rig, asked) });
    if (!sent) this.sink.setPose(wireOf(asked));
  }

  #of(rig: Rig, asked: Pose): Pick<PosingState, "asked" | "body" | "motions"> {
    const { pose: body } = constrain(rig, asked);
    return { asked, body, motions: forward(rig, body) };
  }
}

/** Radians of what a person typed: "35", "35.5°", "-12,5"; null where it is no number. */
export function typedDegrees(text: string): number | null {
  const plain = text.trim().replace("\u2212", "-").replace(",", ".").replace(/\s*(°|deg|degrees)$/i, "");
  return /^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain) ? Number(plain) / DEGREES : null;
}
