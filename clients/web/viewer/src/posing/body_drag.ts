// SPDX-License-Identifier: Apache-2.0
// A part of the body that is pulled: the server finds the pose, shows it to everybody, and what is left of the way is a line.

import { IkLoop } from "./ik_loop.js";
import { move, moveBack } from "./forward.js";
import { poseOf, type WirePose } from "./pose.js";
import type { Poser } from "./poser.js";
import type { Vec3 } from "./rotation.js";
import { labelOf } from "../state/names.js";
import { Store } from "../state/store.js";

export interface IkTarget {
  readonly segment: number;
  readonly restPoint: { readonly x: number; readonly y: number; readonly z: number };
  readonly target: { readonly x: number; readonly y: number; readonly z: number };
  readonly weight: number;
}

export interface IkServer {
  solveIk(targets: IkTarget[], options: { from: number[]; apply: boolean; moveRoot: boolean }): Promise<WirePose & { readonly residual: readonly number[] }>;
}

/** What is seen of a pull; mm, LPS. */
export interface Pull {
  readonly segment: number;
  /** Where the part came to, and where it was asked to. */
  readonly reached: Vec3;
  readonly target: Vec3;
  readonly residual: number;
}

const at = (v: Vec3) => ({ x: v[0], y: v[1], z: v[2] });

/** A pin counts so many times as the part that is pulled. */
const PIN_WEIGHT = 30;
/** What the server takes in one request. */
const MOST_TARGETS = 64;

export class BodyDrag {
  readonly store = new Store<{ pull: Pull | null; moveRoot: boolean }>({ pull: null, moveRoot: false });
  #loop: IkLoop<Vec3, WirePose & { readonly residual: readonly number[] }> | null = null;
  #grip: { segment: number; restPoint: Vec3 } | null = null;

  constructor(private readonly poser: Poser, private readonly server: IkServer, private readonly say: (text: string) => void) {}

  /** Takes hold of a segment at a place of the posed body. False where poses are not taken. */
  begin(segment: number, place: Vec3): boolean {
    this.#finish();
    if (!this.poser.begin()) return false;
    const restPoint = moveBack(this.poser.state.motions[segment]!, place);
    this.#grip = { segment, restPoint };
    this.store.set({ pull: { segment, reached: place, target: place, residual: 0 } });
    this.#loop = new IkLoop(
      (target) => this.#solve(segment, restPoint, target),
      (found, target) => this.#found(found, target),
      (error) => {
        this.say(`The pose could not be found: ${error.message}`);
        this.cancel();
      },
    );
    return true;
  }

  aim(target: Vec3): void {
    const { pull } = this.store.state;
    if (!pull) return;
    this.store.set({ pull: { ...pull, target } });
    this.#loop?.aim(target);
  }

  /** When the newest target has been answered. */
  async settled(): Promise<void> {
    await this.#loop?.settled();
  }

  /** Lets go: the newest target is still answered, and the whole pull is one step to undo. */
  async end(): Promise<void> {
    const loop = this.#loop;
    if (!loop) return;
    await loop.settled();
    if (this.#loop === loop) this.#finish();
  }

  /** As if nothing had been pulled. */
  cancel(): void {
    if (!this.#loop) return;
    this.#loop.stop();
    this.#loop = null;
    this.#grip = null;
    this.store.set({ pull: null });
    this.poser.cancel();
  }

  /** In one go, as from fields: brings a place of a segment to another. Resolves with what is left of the way, mm. */
  async reach(segment: number, place: Vec3, target: Vec3): Promise<number | null> {
    if (!this.begin(segment, place)) return null;
    this.aim(target);
    await this.settled();
    const left = this.store.state.pull?.residual ?? null;
    await this.end();
    return left;
  }

  setMoveRoot(moveRoot: boolean): void {
    this.store.set({ moveRoot });
  }

  #solve(segment: number, restPoint: Vec3, target: Vec3) {
    const { pins, asked } = this.poser.state;
    const targets: IkTarget[] = [{ segment, restPoint: at(restPoint), target: at(target), weight: 1 }];
    for (const pin of pins) {
      if (pin.segment === segment) continue;
      for (const { rest, place } of pin.points) targets.push({ segment: pin.segment, restPoint: at(rest), target: at(place), weight: PIN_WEIGHT });
    }
    return this.server.solveIk(targets.slice(0, MOST_TARGETS), { from: asked.rotation.flat(), apply: true, moveRoot: this.store.state.moveRoot || segment === 0 });
  }

  #found(found: WirePose & { readonly residual: readonly number[] }, target: Vec3): void {
    const { rig } = this.poser.state;
    const grip = this.#grip;
    if (!rig || !grip) return;
    this.poser.show(poseOf(rig, found), true);
    const reached = move(this.poser.state.motions[grip.segment]!, grip.restPoint);
    const newest = this.store.state.pull?.target ?? target;
    this.store.set({ pull: { segment: grip.segment, reached, target: newest, residual: found.residual[0] ?? 0 } });
  }

  #finish(): void {
    const loop = this.#loop;
    if (!loop) return;
    loop.stop();
    this.#loop = null;
    const { rig } = this.poser.state;
    const name = rig && this.#grip ? labelOf(rig.segments[this.#grip.segment]!.name).toLowerCase() : "the body";
    this.#grip = null;
    this.store.set({ pull: null });
    this.poser.commit(`Pull ${name}`);
  }
}
