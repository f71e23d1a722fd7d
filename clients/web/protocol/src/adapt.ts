// SPDX-License-Identifier: Apache-2.0
// Keeps a stream's choices at what policy.ts says.
import type { Client } from "./client.js";
import { ConnectionError } from "./errors.js";
import type { MeshStream } from "./mesh_stream.js";
import { Policy, type Choice } from "./policy.js";

const REST_MS = 300;

export interface Adaptation {
  /** What drawing one frame took. */
  drawn(milliseconds: number): void;
  stop(): void;
}

/** `onChoice`: what is asked for from now on. `policy`: a stream's first choices should be those of its choice(false). */
export function adapt(client: Client, stream: MeshStream, onChoice: (choice: Choice) => void = () => {}, policy = new Policy()): Adaptation {
  let drawMs = 0, moving = false, pose = stream.latest?.poseSequence, rest: ReturnType<typeof setTimeout> | undefined;
  let applied = policy.choice(false), applying = false;

  async function apply(): Promise<void> {
    if (applying || client.state.state !== "open") return;  // a client that comes back subscribes by stream.options
    applying = true;
    try {
      for (let next = policy.choice(moving); !same(next, applied); next = policy.choice(moving)) {
        await client.changeMesh(stream, { ...stream.options, ...next });
        applied = next;
        onChoice(next);
      }
    } catch (error) {
      if (!(error instanceof ConnectionError)) throw error;
    } finally {
      applying = false;
    }
  }

  const offs = [
    stream.on("frame", ({ poseSequence }) => {
      if (poseSequence === pose) return;
      pose = poseSequence;
      clearTimeout(rest);
      rest = setTimeout(() => { moving = false; void apply(); }, REST_MS);
      if (!moving) { moving = true; void apply(); }
    }),
    client.on("statistics", (statistics) => {
      if (moving) policy.observe({ ...statistics, drawMs });
      void apply();
    }),
  ];
  return {
    drawn(milliseconds) { drawMs = drawMs === 0 ? milliseconds : 0.8 * drawMs + 0.2 * milliseconds; },
    stop() { clearTimeout(rest); offs.forEach((off) => off()); },
  };
}

const same = (one: Choice, other: Choice): boolean => one.level === other.level && one.encoding === other.encoding && one.maxRate === other.maxRate;
