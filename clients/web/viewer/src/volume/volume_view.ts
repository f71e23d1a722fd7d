// SPDX-License-Identifier: Apache-2.0
// The posed volume in the picture: fetched while it is shown, followed as the body moves, with the looks that were chosen.
import { VolumeStream, type ModelOpened, type VolumeImage } from "../../../protocol/src/index.js";
import type { App } from "../app.js";
import { wordsOf } from "../errors.js";
import { Store } from "../state/store.js";
import { windowRound } from "../slices/window.js";
import { RayCaster, type Looks } from "./ray_caster.js";
import { PLAIN, TRANSFER_PRESETS, type TransferPreset } from "./transfer.js";
import { VolumeTexture } from "./volume_texture.js";

export interface VolumeChoice {
  readonly name: string;
  readonly hounsfield: boolean;
}

export interface VolumeState extends Looks {
  readonly on: boolean;
  readonly volumes: readonly VolumeChoice[];
  readonly volume: string | null;
  /** The surfaces of the body are drawn, too. */
  readonly surfaces: boolean;
  /** 1: every voxel is shown; else so many along each axis as one. Null: nothing has come. */
  readonly factor: number | null;
  /** The pose that is shown. */
  readonly poseSequence: bigint;
}

const AIR = -900;
// A moving volume comes beside the meshes, which come first; the last pose always does.
const MOST_A_SECOND = 3;
const BONE = TRANSFER_PRESETS[0]!;

export class VolumeView {
  readonly store = new Store<VolumeState>({
    on: false, volumes: [], volume: null, surfaces: false, factor: null, poseSequence: 0n,
    preset: BONE, level: BONE.level, width: BONE.width, density: 1, shaded: true,
  });
  readonly caster: RayCaster;
  #stream: VolumeStream | null = null;
  #identity = 0n;
  /** The window is still to be chosen by the numbers that come. */
  #unwindowed = false;

  constructor(private readonly app: App) {
    const { store } = this;
    this.caster = new RayCaster(app.stage, app.body);
    app.live.onOpened(({ model }) => this.#opened(model));
    app.live.onTopology(() => this.caster.topologyChanged());
    app.live.onBody(() => this.caster.changed());
    for (const select of [(s: typeof app.store.state) => s.layers, (s: typeof app.store.state) => s.isolated, (s: typeof app.store.state) => s.seeThrough]) {
      app.store.watch<unknown>(select, () => this.caster.changed());
    }
    for (const select of [(s: VolumeState) => s.on, (s: VolumeState) => s.volume]) store.watch<unknown>(select, () => this.#follow());
    for (const select of [(s: VolumeState) => s.on, (s: VolumeState) => s.surfaces]) store.watch<unknown>(select, () => this.#surfaces());
    for (const select of [(s: VolumeState) => s.preset, (s: VolumeState) => s.level, (s: VolumeState) => s.width, (s: VolumeState) => s.density, (s: VolumeState) => s.shaded]) {
      store.watch<unknown>(select, () => this.caster.setLooks(store.state));
    }
  }

  get volume(): VolumeChoice | undefined {
    return this.store.state.volumes.find(({ name }) => name === this.store.state.volume);
  }

  toggle(): void {
    if (this.store.state.volumes.length === 0) return this.app.say("This model holds no volume that could be shown");
    this.store.set({ on: !this.store.state.on });
  }

  choose(name: string): void {
    if (name === this.store.state.volume) return;
    const hounsfield = this.store.state.volumes.find((each) => each.name === name)?.hounsfield ?? false;
    this.#unwindowed = !hounsfield;
    this.store.set({ volume: name, factor: null });
    this.setPreset(hounsfield ? BONE : PLAIN);
  }

  setPreset(preset: TransferPreset): void {
    const { level, width } = preset === PLAIN ? this.store.state : preset;
    this.store.set({ preset, level, width });
  }

  setWindow(level: number, width: number): void {
    this.#unwindowed = false;
    this.store.set({ level, width: Math.max(this.volume?.hounsfield === false ? 1e-6 : 1, width) });
  }

  /** A whole posed volume, of the server or of a test. */
  show(image: VolumeImage, poseSequence: bigint): void {
    const { gl, max } = this.#card();
    const texture = new VolumeTexture(image, max);
    if (this.#unwindowed) {
      const { level, width } = windowRound(sampleOf(image), this.app.live.client?.model?.volumes.find(({ name }) => name === this.store.state.volume)?.background ?? NaN);
      this.setWindow(level, width);
    }
    this.caster.setVolume(texture, this.store.state);
    this.caster.setShown(this.store.state.on && !gl.isContextLost());
    this.store.set({ factor: texture.factor, poseSequence });
  }

  #card(): { gl: WebGL2RenderingContext; max: number } {
    const gl = this.app.stage.renderer.getContext() as WebGL2RenderingContext;
    return { gl, max: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number };
  }

  #opened(model: ModelOpened): void {
    if (model.identity === this.#identity) return;
    this.#identity = model.identity;
    this.#end();
    const volumes = model.volumes.filter(({ labels, components }) => !labels && components === 1).map(({ name, background }) => ({ name, hounsfield: background <= AIR }));
    this.store.set({ volumes, volume: null, factor: null, on: this.store.state.on && volumes.length > 0 });
    if (volumes[0]) this.choose(volumes[0].name);
  }

  #end(): void {
    this.#stream?.close();
    this.#stream = null;
  }

  #follow(): void {
    this.#end();
    const { on, volume } = this.store.state, { client } = this.app.live;
    this.caster.setShown(on && this.store.state.factor !== null);
    if (!on || !volume || !client) return;
    this.#stream = new VolumeStream(client, { volume, changedBricks: true, maxRate: MOST_A_SECOND }, {
      shown: ({ image, poseSequence }) => {
        try {
          this.show(image, poseSequence);
        } catch (error) {
          this.#failed(error);
        }
      },
      failed: (error) => this.#failed(error),
    });
  }

  #failed(error: unknown): void {
    this.store.set({ on: false });
    this.app.say(`The volume is not shown: ${wordsOf(error)}`);
  }

  #surfaces(): void {
    const { on, surfaces } = this.store.state;
    this.app.body.group.visible = !on || surfaces;
    this.caster.changed();
    this.app.stage.invalidate();
  }
}

/** Enough of its numbers to choose a window by. */
function sampleOf({ voxels }: VolumeImage): VolumeImage["voxels"] {
  const every = Math.max(1, Math.floor(voxels.length / 200_000));
  return voxels.filter((_, at) => at % every === 0) as VolumeImage["voxels"];
}
