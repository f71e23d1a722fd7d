// SPDX-License-Identifier: Apache-2.0
// The planes as they come from the server: a subscription for each plane of each volume, anew for every place that one scrolls to. One
// request of a plane is on its way at a time, and the newest wish follows it.
import { arrayOf, type Client, type KnownScalar, type VolumeFrame } from "../../../protocol/src/index.js";
import { samePlane, stepsOf, type PlaneGeometry, type PlaneId } from "./plane.js";
import type { Numbers } from "./window.js";
import { wordsOf } from "../errors.js";

export interface PlanePicture {
  readonly plane: PlaneGeometry;
  readonly volume: string;
  /** One a pixel; of a volume with several components the first. */
  readonly values: Numbers;
  readonly poseSequence: bigint;
}

interface Track {
  readonly volume: string;
  readonly id: PlaneId;
  wanted: PlaneGeometry | null;
  shown: PlaneGeometry | null;
  subscription: number | null;
  busy: boolean;
}

// A moving body's planes come beside its meshes, which come first.
const MOST_A_SECOND = 15;

export class PlaneFeed {
  #client: Client | null = null;
  #tracks = new Map<string, Track>();
  #stop: (() => void)[] = [];

  constructor(private readonly show: (picture: PlanePicture) => void, private readonly say: (problem: string) => void) {}

  /** The client whose session is shown; the same one again after it lost its subscriptions. */
  follow(client: Client): void {
    if (client !== this.#client) {
      for (const stop of this.#stop) stop();
      this.#client = client;
      this.#stop = [
        client.on("volume", ({ frame, payload }) => this.#take(frame, payload)),
        client.on("state", ({ state }) => state === "open" && this.#again()),
      ];
    }
    this.#again();
  }

  /** Only these planes of these volumes, from now on; none: nothing more comes. */
  want(planes: readonly PlaneGeometry[], volumes: readonly string[]): void {
    for (const volume of volumes) {
      for (const plane of planes) {
        const key = `${volume} ${plane.id}`;
        let track = this.#tracks.get(key);
        if (!track) this.#tracks.set(key, track = { volume, id: plane.id, wanted: null, shown: null, subscription: null, busy: false });
        track.wanted = plane;
      }
    }
    for (const track of this.#tracks.values()) {
      const asked = volumes.includes(track.volume) && planes.some(({ id }) => id === track.id);
      if (!asked) track.wanted = null;
      void this.#drive(track);
    }
  }

  /** After a loss: numbers of subscriptions are others, or none. */
  #again(): void {
    const resumed = this.#client?.hello.resumed?.subscriptions ?? [];
    for (const track of this.#tracks.values()) {
      const now = resumed.find(({ was }) => was === track.subscription);
      if (now) void this.#end(now.is);
      track.subscription = null;
      track.shown = null;
      void this.#drive(track);
    }
  }

  async #drive(track: Track): Promise<void> {
    if (track.busy) return;
    track.busy = true;
    try {
      while (this.#client && !isCurrent(track)) {
        const { wanted } = track, before = track.subscription;
        // Until the answer, frames are of the plane before.
        const subscription = wanted && await this.#subscribe(this.#client, track.volume, wanted);
        track.shown = wanted;
        track.subscription = subscription;
        if (before !== null && before !== track.subscription) await this.#end(before);
      }
    } catch (error) {
      track.subscription = null;
      track.shown = null;
      // A line that is down mends itself, and says so in its own place.
      if (this.#client?.state.state === "open") {
        track.wanted = null;
        this.say(`The ${track.id} plane of ${track.volume} does not come: ${wordsOf(error)}`);
      }
    } finally {
      track.busy = false;
    }
  }

  async #subscribe(client: Client, volume: string, plane: PlaneGeometry): Promise<number> {
    const { u, v } = stepsOf(plane);
    const vector = ([x, y, z]: readonly [number, number, number]) => ({ $typeName: "ecorche.v1.Vector3" as const, x, y, z });
    const answer = await client.ask({
      case: "subscribe",
      value: {
        $typeName: "ecorche.v1.Subscribe", maxRate: MOST_A_SECOND,
        what: {
          case: "volume",
          value: {
            $typeName: "ecorche.v1.VolumeSelection", volume, nearest: false, compressed: false, changedBricks: false, deformer: 0,
            slices: [{ $typeName: "ecorche.v1.Slice", origin: vector(plane.origin), u: vector(u), v: vector(v), sizeU: plane.width, sizeV: plane.height }],
          },
        },
      },
    }, "subscribed");
    return answer.value.subscription;
  }

  async #end(subscription: number): Promise<void> {
    // Equal planes share a number, also of two volumes' tracks that a change of volume made alike.
    if ([...this.#tracks.values()].some((track) => track.subscription === subscription)) return;
    await this.#client?.ask({ case: "unsubscribe", value: { $typeName: "ecorche.v1.Unsubscribe", subscription } }, "status");
  }

  #take(frame: VolumeFrame, payload: Uint8Array): void {
    const track = [...this.#tracks.values()].find(({ subscription }) => subscription === frame.subscription);
    if (!track?.shown) return;
    if (frame.status && frame.status.code !== 0) return this.say(frame.status.message);
    const { voxels, poseSequence } = frame;
    const components = voxels?.components ?? 1;
    const all: Numbers = arrayOf(voxels, payload as Uint8Array<ArrayBuffer>, (voxels?.type ?? 0) as KnownScalar, components);
    const values = components === 1 ? all : all.filter((_, i) => i % components === 0);
    const pixels = track.shown.width * track.shown.height;
    if (values.length !== pixels) return this.say(`a plane of ${pixels} pixels came with ${values.length}`);
    this.show({ plane: track.shown, volume: track.volume, values, poseSequence });
  }
}

const isCurrent = ({ wanted, shown }: Track): boolean => (wanted && shown ? samePlane(wanted, shown) : wanted === shown);
