// SPDX-License-Identifier: Apache-2.0
// What the balls hang on, as a person changes it: each change is a step that can be undone, and goes to the server at once.
import type { Spheres } from "../../../protocol/src/index.js";
import type { Motion } from "../posing/forward.js";
import { move } from "../posing/forward.js";
import { add, conjugate, multiply, rotate, subtract, type Vec3 } from "../posing/rotation.js";
import type { Rig } from "../posing/rig.js";
import type { History } from "../state/history.js";
import { Store } from "../state/store.js";

export interface HangingState {
  readonly volume: string | null;
  readonly spheres: Spheres | null;
  /** Of every ball; of every segment: replaced, never written to. */
  readonly segment: Int32Array;
  readonly joints: Float64Array;
  /** Rows of balls. */
  readonly picked: ReadonlySet<number>;
}

/** Takes what balls hang on to where they are used. */
export type SendHanging = (volume: string, segment: Int32Array, joints: Float64Array) => Promise<void>;

type Hung = Pick<HangingState, "segment" | "joints">;

export class Hanging {
  readonly store = new Store<HangingState>({ volume: null, spheres: null, segment: new Int32Array(), joints: new Float64Array(), picked: new Set() });
  #sending: Promise<void> | null = null;
  #again = false;

  constructor(private readonly history: History, private readonly send: SendHanging, private readonly say: (text: string) => void) {}

  open(volume: string, spheres: Spheres): void {
    this.store.set({ volume, spheres, segment: spheres.segment, joints: spheres.joints, picked: new Set() });
  }

  close(): void {
    this.store.set({ volume: null, spheres: null, segment: new Int32Array(), joints: new Float64Array(), picked: new Set() });
  }

  pick(rows: Iterable<number>, how: "replace" | "add" | "remove"): void {
    const picked = new Set(how === "replace" ? [] : this.store.state.picked);
    for (const row of rows) how === "remove" ? picked.delete(row) : picked.add(row);
    this.store.set({ picked });
  }

  assign(segment: number, name: string): void {
    const { picked } = this.store.state, next = this.store.state.segment.slice();
    if (picked.size === 0) return this.say("Pick balls first");
    for (const row of picked) next[row] = segment;
    this.#step(`Hang ${picked.size} ${picked.size === 1 ? "ball" : "balls"} on ${name}`, { segment: next });
  }

  /** mm, LPS, in the scan. */
  moveJoint(row: number, place: Vec3, name: string): void {
    const joints = this.store.state.joints.slice();
    joints.set(place, 3 * row);
    this.#step(`Move the joint ${name}`, { joints }, `joint ${row}`);
  }

  /** As the model has it. */
  reset(segment: Int32Array, joints: Float64Array): void {
    this.#step("Hang all as the model has it", { segment: segment.slice(), joints: joints.slice() });
  }

  #step(label: string, patch: Partial<Hung>, key?: string): void {
    const { segment, joints, spheres } = this.store.state, before: Hung = { segment, joints }, after = { ...before, ...patch };
    const set = (hung: Hung) => {
      // Of a volume that is open no more nothing is shown.
      if (this.store.state.spheres !== spheres) return;
      this.store.set(hung);
      this.#tell();
    };
    this.history.run({ label, ...(key === undefined ? {} : { key }), undo: () => set(before), redo: () => set(after) });
  }

  /** One at a time; the newest follows it. */
  #tell(): void {
    if (this.#sending) {
      this.#again = true;
      return;
    }
    const { volume, segment, joints } = this.store.state;
    if (!volume) return;
    this.#sending = this.send(volume, segment, joints).catch((error: unknown) => {
      this.say(`The balls hang here alone: ${error instanceof Error ? error.message : error}`);
    }).then(() => {
      this.#sending = null;
      if (!this.#again) return;
      this.#again = false;
      this.#tell();
    });
  }

  /** Once the server has the newest. */
  async sent(): Promise<void> {
    while (this.#sending) await this.#sending;
  }
}

/** The motions of a pose when joints lie elsewhere than in the rig: the twin of runtime/spheres/hanging.cpp. */
export function aboutJoints(rig: Rig, joints: Float64Array, motions: readonly Motion[]): Motion[] {
  const out: Motion[] = [];
  rig.segments.forEach(({ parent, joint: { center } }, row) => {
    const motion = motions[row]!, above = parent < 0 ? null : motions[parent]!;
    const q = above ? multiply(conjugate(above.q), motion.q) : motion.q;
    const t = above ? rotate(conjugate(above.q), subtract(motion.t, above.t)) : motion.t;
    const is: Vec3 = [joints[3 * row]!, joints[3 * row + 1]!, joints[3 * row + 2]!], shift = subtract(add(rotate(q, center), t), center);
    const local = subtract(add(is, shift), rotate(q, is));
    out.push({ q: motion.q, t: above ? move(out[parent]!, local) : local });
  });
  return out;
}

/** mm. */
export function radiiOf({ grid, metric, distance }: Spheres): Float32Array<ArrayBuffer> {
  const spacing = grid.spacing[0];
  return Float32Array.from(distance, (value) => spacing * (metric === "euclidean" ? Math.sqrt(value) : value / Math.sqrt(11)));
}
