// SPDX-License-Identifier: Apache-2.0
// Motion that the server plays, and what it records: asked for here, told by the server.
import { Feature, type Client, type ClipState, type ClipSummary } from "../../../protocol/src/index.js";
import { Store } from "../state/store.js";
import { askServer } from "./ask_server.js";

export interface ClipsState {
  readonly clips: readonly ClipSummary[];
  /** The server has clips or keeps recordings at all; and can pause, seek and step. */
  readonly offered: boolean;
  readonly steers: boolean;
  readonly records: boolean;
  /** What plays, is paused or has ended; null: nothing. */
  readonly now: ClipState | null;
  /** performance.now() when `now` was told. */
  readonly told: number;
  readonly speed: number;
  readonly loop: boolean;
  /** Name of the recording that runs; null: none. */
  readonly recording: string | null;
}

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4] as const;

/** Where the clip is by now, s: it is told twice a second only. */
export function positionNow({ now, told }: Pick<ClipsState, "now" | "told">, time: number): number {
  if (!now) return 0;
  if (!now.playing) return now.position;
  const at = now.position + (now.speed * Math.max(0, time - told)) / 1000;
  return now.loop && now.seconds > 0 ? at % now.seconds : Math.min(at, now.seconds);
}

export class Clips {
  readonly store = new Store<ClipsState>({
    clips: [], offered: false, steers: false, records: false, now: null, told: 0, speed: 1, loop: false, recording: null,
  });
  #client: Client | null = null;

  constructor(private readonly say: (text: string) => void) {}

  follow(client: Client): void {
    this.#client = client;
    client.on("clip", (now) => this.store.set(now.name === "" ? { now: null } : { now, told: performance.now(), speed: now.speed, loop: now.loop }));
    client.on("opened", () => this.#open(client));
    this.#open(client);
  }

  #open(client: Client): void {
    const has = (feature: Feature) => client.hello.features.includes(feature);
    this.store.set({ offered: has(Feature.CLIPS), steers: has(Feature.CLIP_STATE), records: has(Feature.RECORD), now: null, recording: null });
    void this.refresh();
  }

  refresh(): Promise<void> {
    return this.#do(async (client) => {
      if (this.store.state.offered) this.store.set({ clips: await client.listClips() });
    });
  }

  play(name: string, position = 0): Promise<void> {
    return this.#do(async (client) => {
      const { speed, loop, steers } = this.store.state;
      await client.playClip(name, { speed, loop, ...(steers ? { position } : {}) });
      const clip = this.store.state.clips.find((one) => one.name === name);
      // Older servers tell nothing of what they play.
      if (!steers && clip) {
        const { seconds, framesPerSecond } = clip;
        this.store.set({ now: { $typeName: "ecorche.v1.ClipState", name, position: 0, seconds, framesPerSecond, speed, loop, playing: true }, told: performance.now() });
      }
    });
  }

  stop(): Promise<void> {
    return this.#do(async (client) => {
      await client.playClip("");
      this.store.set({ now: null });
    });
  }

  pause(paused: boolean): Promise<void> {
    return this.#do((client) => client.steerClip({ paused }));
  }

  /** A slider that is drawn along asks often: one request on its way, and of the others only the newest. */
  seek(position: number): void {
    this.#wanted = position;
    if (!this.#seeking) void this.#seek();
  }
  #wanted: number | null = null;
  #seeking = false;

  async #seek(): Promise<void> {
    this.#seeking = true;
    while (this.#wanted !== null) {
      const position = this.#wanted;
      this.#wanted = null;
      await this.#do((client) => client.steerClip({ position }));
    }
    this.#seeking = false;
  }

  step(step: number): Promise<void> {
    return this.#do((client) => client.steerClip({ step }));
  }

  setSpeed(speed: number): Promise<void> {
    return this.#change({ speed });
  }

  setLoop(loop: boolean): Promise<void> {
    return this.#change({ loop });
  }

  /** Steers what plays; older servers begin it again. */
  #change(change: { speed?: number; loop?: boolean }): Promise<void> {
    this.store.set(change);
    const { now, steers } = this.store.state;
    if (!now) return Promise.resolve();
    return steers ? this.#do((client) => client.steerClip(change)) : this.play(now.name);
  }

  record(name: string): Promise<void> {
    return this.#do(async (client) => {
      await client.record(name);
      this.store.set({ recording: name });
      this.say(`Recording ${name}`);
    });
  }

  endRecording(): Promise<void> {
    return this.#do(async (client) => {
      const name = this.store.state.recording;
      this.store.set({ recording: null });
      await client.record();
      this.say(`Recorded ${name}: it is among the clips`);
      await this.refresh();
    });
  }

  #do(run: (client: Client) => Promise<void>): Promise<void> {
    return askServer(this.#client, this.say, run);
  }
}
