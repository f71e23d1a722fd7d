// SPDX-License-Identifier: Apache-2.0
// A posed volume as it goes with the body: its subscription, kept over losses of the line, and its decoder in a thread of its own.
import { create } from "@bufbuild/protobuf";
import type { Client } from "../client.js";
import { ConnectionError, ServerError } from "../errors.js";
import { ProtocolError } from "../framing.js";
import { Deformer, SubscribeSchema, type VolumeFrame } from "../gen/ecorche/v1/stream_pb.js";
import { workers } from "../workers.js";
import type { FromDecoder, ToDecoder } from "./channel.js";
import type { VolumeImage } from "./decoder.js";

/** The name of the bundle of worker.ts beside the page's: set by build.mjs. */
declare const ECORCHE_VOLUME_WORKER: string;

export interface VolumeOptions {
  volume: string;
  /** By the balls of the volume's skeleton; else by tets. */
  bySpheres?: boolean;
  /** Only what changed comes while the body moves. */
  changedBricks?: boolean;
  /** At most so many a second; 0: every pose. */
  maxRate?: number;
}

export interface VolumeShown {
  readonly image: VolumeImage;
  readonly poseSequence: bigint;
  /** Of the frame on the wire. */
  readonly bytes: number;
}

export interface VolumeListener {
  shown(shown: VolumeShown): void;
  /** It does not come, or not this one. A line that is down is told by the client, and mends itself. */
  failed(error: Error): void;
}

interface Waiting {
  readonly frame: VolumeFrame;
  readonly payload: Uint8Array<ArrayBuffer>;
}

export class VolumeStream {
  readonly #worker = workers.make(new URL(ECORCHE_VOLUME_WORKER, import.meta.url));
  #subscription: number | null = null;
  #asking = false;
  #closed = false;
  #decoding: Waiting | null = null;
  #waiting: Waiting[] = [];
  readonly #stop: (() => void)[];

  constructor(private readonly client: Client, private readonly options: VolumeOptions, private readonly listener: VolumeListener) {
    this.#worker.onmessage = ({ data }: MessageEvent<FromDecoder>) => this.#decoded(data);
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#fail(new Error(event.message || "the volume's decoder does not start"));
    };
    this.#stop = [
      client.on("volume", ({ frame, payload }) => frame.subscription === this.#subscription && this.#take(frame, payload as Uint8Array<ArrayBuffer>)),
      client.on("state", ({ state }) => state === "open" && this.#again()),
      client.on("opened", () => { this.#subscription = null; }),
    ];
    void this.#subscribe();
  }

  close(): void {
    if (this.#closed) return;
    this.#closed = true;
    for (const stop of this.#stop) stop();
    this.#worker.terminate();
    void this.#unsubscribe();
  }

  async #subscribe(): Promise<void> {
    if (this.#asking || this.#closed) return;
    this.#asking = true;
    const { volume, bySpheres = false, changedBricks = false, maxRate = 0 } = this.options;
    const value = create(SubscribeSchema, {
      maxRate, what: { case: "volume", value: { volume, compressed: true, changedBricks, deformer: bySpheres ? Deformer.SPHERES : Deformer.TETS } },
    });
    try {
      this.#subscription = (await this.client.ask({ case: "subscribe", value }, "subscribed")).value.subscription;
      if (this.#closed) await this.#unsubscribe();
    } catch (error) {
      if (!(error instanceof ConnectionError)) this.#fail(error as Error);
    } finally {
      this.#asking = false;
    }
  }

  async #unsubscribe(): Promise<void> {
    const subscription = this.#subscription;
    this.#subscription = null;
    if (subscription === null) return;
    try {
      await this.client.ask({ case: "unsubscribe", value: { $typeName: "ecorche.v1.Unsubscribe", subscription } }, "status");
    } catch (error) {
      // It ended with the line.
      if (!(error instanceof ConnectionError || error instanceof ServerError)) throw error;
    }
  }

  /** The line is open again: what the server remembers goes on by another number. */
  #again(): void {
    const now = this.client.hello.resumed?.subscriptions.find(({ was }) => was === this.#subscription);
    if (now) this.#subscription = now.is;
    else void this.#subscribe();
  }

  #take(frame: VolumeFrame, payload: Uint8Array<ArrayBuffer>): void {
    if (frame.status && frame.status.code !== 0) return this.#fail(new ServerError(frame.status));
    // Of frames against the same keyframe the newest is enough; a keyframe must not be lost.
    const last = this.#waiting.at(-1);
    if (last?.frame.bricks && frame.bricks) this.#waiting.pop();
    this.#waiting.push({ frame, payload });
    this.#decode();
  }

  #decode(): void {
    if (this.#decoding || this.#closed) return;
    this.#decoding = this.#waiting.shift() ?? null;
    if (this.#decoding) this.#worker.postMessage(this.#decoding satisfies ToDecoder);
  }

  #decoded(answer: FromDecoder): void {
    const { frame, payload } = this.#decoding!;
    this.#decoding = null;
    if (answer.kind === "image") this.listener.shown({ image: answer.image, poseSequence: frame.poseSequence, bytes: payload.byteLength });
    else this.#fail(answer.kind === "refused" ? new ProtocolError(answer.message) : new Error(answer.message));
    this.#decode();
  }

  #fail(error: Error): void {
    if (!this.#closed) this.listener.failed(error);
  }
}

/** The volume of the present pose, or a newer one, once. */
export function fetchVolume(client: Client, options: VolumeOptions, poseSequence = 0n, signal?: AbortSignal): Promise<VolumeShown> {
  return new Promise((resolve, reject) => {
    const end = () => {
      stream.close();
      stop();
      signal?.removeEventListener("abort", aborted);
    };
    const failed = (error: Error) => {
      end();
      reject(error);
    };
    const aborted = () => failed(signal!.reason as Error);
    const stream = new VolumeStream(client, options, {
      failed,
      shown: (shown) => {
        if (shown.poseSequence < poseSequence) return;
        end();
        resolve(shown);
      },
    });
    const stop = client.on("state", ({ state, reason }) => state !== "open" && failed(new ConnectionError(reason)));
    signal?.addEventListener("abort", aborted);
    if (signal?.aborted) aborted();
  });
}
