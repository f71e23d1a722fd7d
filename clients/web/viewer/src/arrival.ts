// SPDX-License-Identifier: Apache-2.0
// How the body comes: chosen by itself from what arrives, or held by hand; and what a frame is to the scene, whichever way it came.
import { adapt, type Adaptation, type BodyFrame, type Client, type GpuSkinner, type Held, type MeshOptions, type MeshStream, type ModelOpened } from "../../protocol/src/index.js";
import type { Positions } from "./scene/body.js";
import type { Stage } from "./scene/stage.js";
import type { Way } from "./state/app_state.js";
import { wordsOf } from "./errors.js";

/** Coarser levels and other ways are for later, and many bytes: the first seconds do without them. */
const CHOOSE_AFTER_MS = 1500;
/** Bodies of more vertices are first shown by a coarser level, which is there, and drawn, much sooner. */
const LARGE = 500_000, COARSE_LEVEL = 2;
const KEY = "ecorche.way";

export class Arrival {
  /** null: by itself. */
  way: Way | null = null;
  #level: number | null = null;
  #adaptation: Adaptation | null = null;
  #make: typeof GpuSkinner | null = null;
  #skinner: GpuSkinner | null = null;
  /** Of `follow`: whoever began before the latest one gives up. */
  #followed = 0;
  #drawStart = 0;
  /** The GPU does not take it: frames, then, as long as this page lives. */
  #fault: string | null = null;

  constructor(private readonly stage: Stage, private readonly say: (text: string) => void) {
    const kept = localStorage.getItem(KEY);
    if (kept === "frames" || kept === "skinning") this.way = kept;
    stage.onBeforeDraw(() => { this.#drawStart = performance.now(); });
    stage.onAfterDraw(() => this.#adaptation?.drawn(performance.now() - this.#drawStart));
    // What the GPU held is lost with its context: the next frame brings it anew.
    stage.canvas.addEventListener("webglcontextlost", () => { this.#skinner = null; });
  }

  /** What the first picture comes by. */
  static firstOf(model: ModelOpened): MeshOptions {
    const vertices = model.tissues.reduce((sum, tissue) => sum + Number(tissue.vertices), 0);
    return { normals: true, ...(vertices > LARGE && { level: COARSE_LEVEL }) };
  }

  follow(client: Client, stream: MeshStream): void {
    this.#adaptation?.stop();
    this.#adaptation = null;
    this.#begin(client, stream, ++this.#followed).catch((error: unknown) => this.say(`The body goes on coming as frames: ${wordsOf(error)}`));
  }

  async #begin(client: Client, stream: MeshStream, turn: number): Promise<void> {
    await this.#drawn(stream);
    // The whole body at once, where the picture shows less of it.
    if (!stream.options.level) await new Promise((resolve) => setTimeout(resolve, CHOOSE_AFTER_MS));
    // Whoever skins has the code ready before the first motions come.
    this.#make = (await import("../../protocol/src/skinning/gpu.js")).GpuSkinner;
    if (this.#followed === turn) this.#adaptation = adapt(client, stream, undefined, { adaptive: true, held: this.#held });
  }

  /** There is a picture of the stream's body. */
  async #drawn(stream: MeshStream): Promise<void> {
    if (!stream.latest) await new Promise<void>((resolve) => { const off = stream.on("frame", () => { off(); resolve(); }); });
    await new Promise<void>((resolve) => { const off = this.stage.onAfterDraw(() => { off(); resolve(); }); });
  }

  /** Held until another is; null: by itself. */
  async setWay(way: Way | null): Promise<void> {
    this.way = way;
    if (way) localStorage.setItem(KEY, way);
    else localStorage.removeItem(KEY);
    await this.#adaptation?.hold(this.#held);
  }

  /** One level of detail and no other, 0 being all; null: as the line bears it. */
  async setLevel(level: number | null): Promise<void> {
    this.#level = level;
    await this.#adaptation?.hold(this.#held);
  }

  get #held(): Held {
    const way = this.#fault ? "frames" : this.way;
    return { ...(this.#level !== null && { level: this.#level }), ...(way !== null && { motions: way === "skinning" }) };
  }

  /** The GPU skins for pictures: of the frames that come before the last one is drawn, only the newest is shown, after that. */
  paced(show: (frame: BodyFrame) => void): (frame: BodyFrame) => void {
    let drawn = true, waiting: BodyFrame | null = null;
    const take = (frame: BodyFrame): void => {
      waiting = frame.skinned && !drawn ? frame : null;
      if (waiting) return this.stage.invalidate();
      drawn = !frame.skinned;
      show(frame);
    };
    this.stage.onAfterDraw(() => {
      drawn = true;
      // What was asked for anew meanwhile has another body.
      if (waiting && waiting === waiting.stream.latest) take(waiting);
      waiting = null;
    });
    return take;
  }

  positionsOf(frame: BodyFrame): Positions {
    const { skinned } = frame;
    if (skinned && !this.#fault) {
      try {
        return this.#skin(skinned);
      } catch (error) {
        this.#fault = wordsOf(error);
        this.say(`The body comes as frames: ${this.#fault}`);
        this.#adaptation?.hold(this.#held).catch(() => {});
      }
    }
    return { numbers: frame.vertices, low: frame.offset, step: frame.scale };
  }

  #skin({ skinning, motions }: NonNullable<BodyFrame["skinned"]>): Positions {
    const { renderer } = this.stage;
    if (this.#skinner?.skinning !== skinning) {
      this.#skinner?.dispose();
      this.#skinner = new this.#make!(renderer.getContext() as WebGL2RenderingContext, skinning);
    }
    const skinner = this.#skinner;
    skinner.skin(motions);
    renderer.resetState();
    let numbers: Uint16Array | undefined;
    return {
      gpu: skinner.buffer, low: skinner.box.offset, step: skinner.box.scale,
      get numbers() { return numbers ??= skinner.read(); },
    };
  }
}
