// SPDX-License-Identifier: Apache-2.0
// The pointer on rings, dots and, where the pulling tool is on, the body itself. Mouse, pen and finger alike.

import type { PointerTool, ScenePointer } from "../scene/tools.js";
import { setAngle } from "./angles.js";
import type { BodyDrag } from "./body_drag.js";
import { withRotation, withTranslation } from "./pose.js";
import type { Poser } from "./poser.js";
import type { Hit, PoseScene, RingHit } from "./pose_scene.js";
import { RingDrag } from "./ring.js";
import { add, subtract, type Vec3 } from "./rotation.js";
import { plain } from "./projector.js";
import { jointLabel, spoken } from "./words.js";

type Hold =
  | { kind: "ring"; row: number; angle: number; drag: RingDrag; atLimit: boolean }
  | { kind: "press"; row: number; place: Vec3; x: number; y: number; grip: Vec3 }
  | { kind: "pull"; place: Vec3; offset: Vec3 }
  | { kind: "root"; place: Vec3; offset: Vec3; from: Vec3 };

const PRESS_PIXELS = 5;

/** The segment under a point of the surface. */
export type SegmentUnder = (tissueRow: number, point: Vec3) => number;

export class PoseTool implements PointerTool {
  /** A pull anywhere on the body moves it; else only rings and dots do. */
  pullsBody = false;
  #hold: Hold | null = null;

  constructor(private readonly poser: Poser, private readonly scene: PoseScene, private readonly body: BodyDrag,
              private readonly under: SegmentUnder, private readonly refused: () => void) {}

  down(pointer: ScenePointer): boolean {
    const hit = this.scene.hit(pointer.x, pointer.y, reachOf(pointer));
    this.scene.hover(hit);
    if (hit?.kind === "ring") return this.#takeRing(hit, pointer);
    if (hit) {
      this.#press(hit.row, hit.center, pointer);
      return true;
    }
    if (!this.pullsBody) return false;
    const picked = pointer.pick();
    if (!picked) return false;
    const place = plain(picked.point);
    this.#press(this.under(picked.row, place), place, pointer);
    return true;
  }

  /** Not yet a pull: that begins where the pointer went down, not where it was when it had gone far enough. */
  #press(row: number, place: Vec3, pointer: ScenePointer): void {
    const grip = this.scene.projector.acrossFrom(place, this.scene.projector.sight(pointer.ray)) ?? place;
    this.#hold = { kind: "press", row, place, x: pointer.x, y: pointer.y, grip };
  }

  move(pointer: ScenePointer): void {
    if (this.#hold?.kind === "press" && Math.hypot(pointer.x - this.#hold.x, pointer.y - this.#hold.y) > PRESS_PIXELS) this.#pull(this.#hold);
    const hold = this.#hold;
    if (!hold) return;
    if (hold.kind === "ring") return this.#turn(hold, pointer);
    if (hold.kind === "press") return;
    const at = this.scene.projector.acrossFrom(hold.place, this.scene.projector.sight(pointer.ray));
    if (!at) return;
    const target = add(at, hold.offset);
    if (hold.kind === "pull") this.body.aim(target);
    else this.poser.show(withTranslation(this.poser.state.asked, 0, add(hold.from, subtract(target, hold.place))));
  }

  up(): void {
    const hold = this.#hold;
    this.#hold = null;
    if (!hold) return;
    if (hold.kind === "ring") this.poser.commit(this.#ringLabel(hold));
    else if (hold.kind === "press") this.poser.select(hold.row);
    else if (hold.kind === "pull") void this.body.end();
    else this.poser.commit("Move the body");
  }

  cancel(): void {
    const hold = this.#hold;
    this.#hold = null;
    if (hold?.kind === "ring" || hold?.kind === "root") this.poser.cancel();
    if (hold?.kind === "pull") this.body.cancel();
    this.scene.hover(null);
  }

  hover(pointer: ScenePointer): boolean {
    const hit: Hit | null = this.scene.hit(pointer.x, pointer.y, reachOf(pointer));
    this.scene.hover(hit);
    return hit !== null;
  }

  #takeRing(hit: RingHit, pointer: ScenePointer): boolean {
    const row = this.poser.state.joint!;
    if (!this.poser.begin()) {
      this.refused();
      return true;
    }
    const drag = new RingDrag(hit.ring, this.scene.projector.sight(pointer.ray), [pointer.x, pointer.y], hit.tangent);
    this.#hold = { kind: "ring", row, angle: hit.ring.angle, drag, atLimit: false };
    return true;
  }

  #turn(hold: Hold & { kind: "ring" }, pointer: ScenePointer): void {
    const { rig, body, asked } = this.poser.state;
    const value = hold.drag.moved(this.scene.projector.sight(pointer.ray), [pointer.x, pointer.y]);
    const set = setAngle(rig!.segments[hold.row]!.joint, body.rotation[hold.row]!, hold.angle, value);
    this.poser.show(withRotation(asked, hold.row, set.rotation));
    if (set.limit !== null) this.poser.sayLimit(hold.row, hold.angle, set.limit, !hold.atLimit);
    hold.atLimit = set.limit !== null;
  }

  #ringLabel(hold: Hold & { kind: "ring" }): string {
    const { joint } = this.poser.state.rig!.segments[hold.row]!;
    return `${jointLabel(joint)}: ${spoken(joint.sequence[hold.angle]!.name, this.poser.angle(hold.row, hold.angle))}`;
  }

  #pull(hold: Hold & { kind: "press" }): void {
    this.poser.select(hold.row);
    const offset = subtract(hold.place, hold.grip);
    this.#hold = null;
    if (hold.row === 0 && this.poser.state.pins.length === 0) {
      if (!this.poser.begin()) return this.refused();
      this.#hold = { kind: "root", place: hold.place, offset, from: this.poser.state.asked.rootTranslation };
    } else {
      if (!this.body.begin(hold.row, hold.place)) return this.refused();
      this.#hold = { kind: "pull", place: hold.place, offset };
    }
  }
}

const reachOf = (pointer: ScenePointer): number => (pointer.event.pointerType === "touch" ? 26 : 11);
