// SPDX-License-Identifier: Apache-2.0
// The viewer, wired: state, scene, panels and the line to the server. Other parts (posing) hook in through what is public here.
import * as THREE from "three";
import { Arrival } from "./arrival.js";
import { Keys } from "./keys.js";
import { Live } from "./live.js";
import { PanelHost } from "./panels/host.js";
import { download, fileName } from "./panels/save.js";
import { Body } from "./scene/body.js";
import { lookOf } from "./scene/palette.js";
import { Picker } from "./scene/picker.js";
import { Stage } from "./scene/stage.js";
import { Tools, type ScenePointer } from "./scene/tools.js";
import { Views, type Side } from "./scene/views.js";
import { firstState, type AppState } from "./state/app_state.js";
import { History } from "./state/history.js";
import { Layers, shownOpacity } from "./state/layers.js";
import { Store } from "./state/store.js";

/** Where things are put on the page; main.ts makes them. */
export interface Places {
  readonly root: HTMLElement;
  readonly canvas: HTMLCanvasElement;
}

export class App {
  readonly store = new Store<AppState>(firstState());
  /** Undone and redone in one order, whatever part did it. */
  readonly history = new History();
  readonly layers = new Layers(this.store, this.history);
  readonly keys = new Keys();
  readonly stage: Stage;
  readonly body: Body;
  readonly picker: Picker;
  readonly views: Views;
  /** Add a PointerTool to take the pointer before the camera does. */
  readonly tools: Tools;
  /** Add a Panel to have a tab. */
  readonly panels: PanelHost;
  /** The client of the protocol, and what it opened. */
  readonly live: Live;
  /** Of the pointer, for the name beside it: `inside` the picture, not over a panel. */
  readonly pointer = new Store<{ x: number; y: number; scalar: number; cap: boolean; inside: boolean }>({ x: 0, y: 0, scalar: 0, cap: false, inside: false });
  /** What say() said last. */
  readonly said = new Store<{ text: string; count: number }>({ text: "", count: 0 });
  /** More parts of the help; each is asked when it opens. */
  readonly helpParts: (() => { title: string; lines: readonly string[] })[] = [];
  #hoverAt: ScenePointer | null = null;
  #hoverAsked = 0;
  #says: HTMLElement;

  constructor(readonly places: Places) {
    this.stage = new Stage(places.canvas);
    this.body = new Body((row) => {
      const tissue = this.store.state.model?.tissues[row];
      return lookOf(tissue?.name ?? "", tissue?.group ?? "other");
    });
    this.stage.patient.add(this.body.group);
    this.picker = new Picker(this.stage, this.body);
    this.views = new Views(this.stage);
    this.tools = new Tools(this.stage, this.picker, {
      click: (pointer) => this.select(pointer.pick()?.row ?? null),
      doubleClick: (pointer) => this.#focusOn(pointer.pick()?.row ?? null),
      hover: (pointer) => this.#hover(pointer),
    });
    this.panels = new PanelHost(places.root, (insets) => this.stage.setInsets(insets));
    this.#says = places.root.querySelector<HTMLElement>("#says")!;
    this.live = new Live(this.store, this.history, this.body, new Arrival(this.stage, (text) => this.say(text)));
    this.live.onBody((first) => this.#bodyCame(first));
    this.#draw();
  }

  select(row: number | null): void {
    this.store.set({ selected: row });
  }

  /** The whole body, or what is shown of it, fills the picture. */
  fit(side?: Side, now = false): void {
    this.views.fit(this.body.bounds(), side, now);
  }

  focusSelected(): void {
    this.#focusOn(this.store.state.selected);
  }

  undo(): void {
    const label = this.history.undo();
    this.say(label ? `Undone: ${label}` : "Nothing to undo");
  }

  redo(): void {
    const label = this.history.redo();
    this.say(label ? `Done again: ${label}` : "Nothing to do again");
  }

  async savePicture(): Promise<void> {
    download(await this.stage.png(), `${fileName(this)}.png`);
  }

  /** A line that shows for a moment and is read out. */
  say(text: string): void {
    this.said.set({ text, count: this.said.state.count + 1 });
    this.#says.textContent = text;
    this.#says.classList.remove("shown");
    // Begins the animation anew.
    void this.#says.offsetWidth;
    this.#says.classList.add("shown");
  }

  #focusOn(row: number | null): void {
    if (row === null) return;
    this.select(row);
    this.views.fit(this.body.bounds([row]));
  }

  /** At most one pick a picture: the pointer moves more often than anybody sees. */
  #hover(pointer: ScenePointer | null): void {
    this.#hoverAt = pointer;
    if (!pointer) {
      cancelAnimationFrame(this.#hoverAsked);
      this.#hoverAsked = 0;
      this.pointer.set({ inside: false });
      this.store.set({ hovered: null });
      return;
    }
    this.#hoverAsked ||= requestAnimationFrame(() => {
      this.#hoverAsked = 0;
      if (!this.#hoverAt) return;
      const { x, y } = this.#hoverAt;
      const picked = this.#hoverAt.pick();
      this.pointer.set({ x, y, scalar: picked?.scalar ?? 0, cap: picked?.cap ?? false, inside: true });
      this.store.set({ hovered: picked?.row ?? null });
    });
  }

  /** What of the state the picture shows. */
  #draw(): void {
    const { store, body, stage } = this;
    const layers = () => {
      for (const { row } of store.state.model?.tissues ?? []) body.setOpacity(row, shownOpacity(store.state, row));
      body.setOutline(store.state.selected);
      if (store.state.selected !== null) body.setGlow(store.state.selected, 0.5);
      stage.invalidate();
    };
    store.watch((state) => state.layers, layers);
    store.watch((state) => state.isolated, layers);
    store.watch((state) => state.seeThrough, layers);
    this.live.onTopology(layers);
    const glow = (row: number | null, strength: number) => {
      if (row !== null) body.setGlow(row, strength);
      stage.invalidate();
    };
    store.watch((state) => state.hovered, (row, before) => {
      glow(before, before === store.state.selected ? 0.5 : 0);
      glow(row, row === store.state.selected ? 0.6 : 0.35);
      stage.canvas.classList.toggle("pointing", row !== null);
    });
    store.watch((state) => state.selected, (row, before) => {
      glow(before, 0);
      glow(row, 0.5);
      body.setOutline(row);
    });
    stage.onBeforeDraw(() => stage.renderer.getDrawingBufferSize(body.shared.viewport.value));
  }

  #bodyCame(first: boolean): void {
    if (first) {
      const box = this.body.bounds();
      this.fit("front", true);
      const low = box.min.clone(), size = box.getSize(new THREE.Vector3());
      const center = box.getCenter(new THREE.Vector3()).setZ(low.z).applyMatrix4(this.stage.patient.matrix);
      this.stage.placeGround(center.x, center.y, center.z, (Math.max(size.x, size.y) / 1000) * 0.9);
    }
    this.stage.invalidate();
    if (first) {
      const stop = this.stage.onAfterDraw(() => {
        performance.mark("ecorche body");
        stop();
      });
    }
  }
}
