// SPDX-License-Identifier: Apache-2.0
// The clipping plane in the picture: what it cuts, the lids where it cuts, and its handle.
import * as THREE from "three";
import type { App } from "../app.js";
import { three } from "../posing/projector.js";
import type { Vec3 } from "../posing/rotation.js";
import { ClipCaps } from "../scene/clip_caps.js";
import { groupOrder } from "../state/names.js";
import { Store } from "../state/store.js";
import { firstClip, kept, type Clip } from "./clip.js";
import { ClipHandle } from "./clip_handle.js";
import type { Slices } from "./slices.js";

export class Clipping {
  readonly store = new Store<{ clip: Clip }>({ clip: firstClip() });
  readonly #plane = new THREE.Plane();
  readonly #caps: ClipCaps;
  #placed = false;

  constructor(private readonly app: App, private readonly slices: Slices) {
    this.#caps = new ClipCaps(app.stage, app.body, this.#plane);
    app.tools.add(new ClipHandle(app.stage, this.store));
    this.store.watch((state) => state.clip, (clip) => this.#show(clip), true);
    const tissues = () => {
      const all = app.store.state.model?.tissues ?? [];
      this.#caps.setTissues([...all].sort((a, b) => groupOrder(a.group) - groupOrder(b.group) || a.row - b.row));
    };
    app.live.onTopology(tissues);
    tissues();
  }

  toggle(): void {
    const { clip } = this.store.state;
    // Through the middle of the body at first, and later where it was.
    if (!clip.on && !this.#placed) {
      this.#placed = true;
      const { x, y, z } = this.app.body.bounds().getCenter(new THREE.Vector3());
      return this.store.set({ clip: { ...clip, on: true, at: [x, y, z] } });
    }
    this.store.set({ clip: { ...clip, on: !clip.on } });
  }

  toCross(): void {
    const { open, cross } = this.slices.store.state;
    if (!open) return this.app.say("Show the slices first: their cross-hair says where");
    this.store.set({ clip: { ...this.store.state.clip, at: cross as Vec3 } });
  }

  #show(clip: Clip): void {
    const { patient } = this.app.stage;
    // three.js keeps what lies on the side of the normal.
    const normal = three(kept(clip)).transformDirection(patient.matrix);
    this.#plane.setFromNormalAndCoplanarPoint(normal, three(clip.at).applyMatrix4(patient.matrix));
    this.app.body.setClipping(clip.on ? [this.#plane] : []);
    this.#caps.setOn(clip.on);
    this.app.stage.invalidate();
  }
}
