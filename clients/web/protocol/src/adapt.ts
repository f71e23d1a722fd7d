// SPDX-License-Identifier: Apache-2.0
// Keeps a stream's choices at what policy.ts says of the device, line.ts of the line, and what somebody holds by hand.
import type { Client } from "./client.js";
import { ConnectionError } from "./errors.js";
import { Feature } from "./gen/ecorche/v1/hello_pb.js";
import { LinePolicy } from "./line.js";
import type { MeshOptions, MeshStream } from "./mesh_stream.js";
import { Policy, type Choice } from "./policy.js";

const REST_MS = 300, FINER_AFTER_SECONDS = 2;

/** What is held, whatever arrives. */
export interface Held {
  /** This level of detail and no other. */
  level?: number;
  /** true: skinned by the client; false: as frames. */
  motions?: boolean;
}

export interface Adaptation {
  /** What drawing one frame took. */
  drawn(milliseconds: number): void;
  /** Nothing held: as the line and the device bear it. Rejects where the server refuses; then what was held before is. */
  hold(held: Held): Promise<void>;
  stop(): void;
}

export interface AdaptOptions {
  policy?: Policy;
  line?: LinePolicy;
  /** The server may send coarser levels of frames, too (MeshOptions.adaptive). */
  adaptive?: boolean;
  held?: Held;
}

export type AdaptedOptions = Choice & Pick<MeshOptions, "motions" | "adaptive">;

/** `onChoice`: what is asked for from now on. The stream's first choices should be those of the policy's choice(false), but for its level. */
export function adapt(client: Client, stream: MeshStream, onChoice: (choice: AdaptedOptions) => void = () => {}, options: AdaptOptions = {}): Adaptation {
  const vertices = client.model?.tissues.reduce((sum, tissue) => sum + Number(tissue.vertices), 0) ?? 0;
  const { policy = new Policy(), adaptive = false, line = new LinePolicy(vertices, client.hello.features.includes(Feature.SKINNING)) } = options;
  let drawMs = 0, moving = false, pose = stream.latest?.poseSequence, rest: ReturnType<typeof setTimeout> | undefined;
  let held = options.held ?? {}, work = Promise.resolve(), coarserBy = 0, servedMs = 0;
  let newest = 0n, counted: bigint | undefined, stirred = 0, still = 0;  // of what the body took up
  let applied = { ...choose({ adaptive: stream.options.adaptive ?? false, held: {} }), level: stream.options.level ?? 0 };

  function choose(by: { adaptive: boolean; held: Held } = { adaptive, held }): AdaptedOptions {
    const motions = by.held.motions ?? line.skins !== undefined, choice = policy.choice(moving);
    // Another level is another table: what is skinned keeps the one that it has, however the body moves.
    const level = by.held.level ?? (motions ? line.skins ?? 0 : choice.level);
    // Of motions every one is taken: a few bytes, decoded at once. Another subscription would bring the table anew.
    return { ...choice, level, motions, maxRate: motions ? 0 : choice.maxRate, adaptive: by.adaptive && !motions && by.held.level === undefined };
  }

  /** One change after the other. */
  function apply(): Promise<void> {
    work = work.catch(() => {}).then(async () => {
      for (let next = choose(); client.state.state === "open" && !same(next, applied); next = choose()) {
        await client.changeMesh(stream, { ...stream.options, ...next });
        applied = next;
        onChoice(next);
      }
    });
    return work;
  }

  /** A client that comes back subscribes by stream.options. */
  const applySoon = (): void => void apply().catch((error: unknown) => { if (!(error instanceof ConnectionError)) throw error; });

  function stir(sequence: bigint): void {
    if (sequence <= newest) return;
    newest = sequence;
    counted ??= sequence;
    stirred = performance.now();
  }

  const offs = [
    stream.on("frame", ({ poseSequence, level, timings }) => {
      servedMs = Math.max(servedMs, timings ? Number(timings.waited + timings.posed + timings.encoded) / 1000 : 0);
      coarserBy = level - (stream.options.level ?? 0);
      stir(poseSequence);
      if (poseSequence === pose) return;
      pose = poseSequence;
      clearTimeout(rest);
      rest = setTimeout(() => { moving = false; applySoon(); }, REST_MS);
      if (!moving) { moving = true; applySoon(); }
    }),
    client.on("pose", ({ sequence }) => stir(sequence)),
    client.on("statistics", (statistics) => {
      const active = performance.now() - stirred < 1500, posesPerSecond = Number(newest - (counted ?? newest));
      counted = newest;
      if (moving) policy.observe({ ...statistics, drawMs });
      if (active && !applied.motions) line.observe({ ...statistics, posesPerSecond, coarserBy, busyMs: Math.max(statistics.lagMs, servedMs) });
      servedMs = 0;
      still = active ? 0 : still + 1;
      if (still >= FINER_AFTER_SECONDS && held.level === undefined) {
        still = 0;
        line.rest();
      }
      applySoon();
    }),
  ];
  applySoon();
  return {
    drawn(milliseconds) { drawMs = drawMs === 0 ? milliseconds : 0.8 * drawMs + 0.2 * milliseconds; },
    async hold(next) {
      const before = held;
      held = next;
      try {
        await apply();
      } catch (error) {
        if (held === next) held = before;
        throw error;
      }
    },
    stop() { clearTimeout(rest); offs.forEach((off) => off()); },
  };
}

/** Motions have no encoding. */
const same = (one: AdaptedOptions, other: AdaptedOptions): boolean => one.level === other.level && one.motions === other.motions
  && (one.motions || one.encoding === other.encoding) && one.maxRate === other.maxRate && one.adaptive === other.adaptive;
