// SPDX-License-Identifier: Apache-2.0
// All that the viewer shows, in one object.

export type LinkState = "connecting" | "open" | "reconnecting" | "closed";

export interface Link {
  readonly state: LinkState;
  /** Why it is not open, in plain words; empty while it is. */
  readonly reason: string;
  /** It is tried again without anybody's help. */
  readonly mends: boolean;
  /** When it is tried again, as Date.now() counts. */
  readonly retryAt?: number;
}

export interface Stats {
  readonly framesPerSecond: number;
  readonly bytesPerSecond: number;
  readonly latencyMs: number;
  /** 0 is all; each next one has about a quarter of the triangles. */
  readonly level: number;
  /** How the body comes: its vertices, or what they are skinned by here. */
  readonly way: Way;
}

/** `frames`: the server's vertices; `skinning`: the segments' motions. */
export type Way = "frames" | "skinning";

export interface Tissue {
  /** Row of ModelOpened.tissues. */
  readonly row: number;
  readonly name: string;
  readonly label: string;
  readonly group: string;
  /** Row of the segment that carries a bone; -1 for what deforms. */
  readonly segment: number;
  readonly vertices: number;
  /** The border of the scan cuts it, and flat caps close it there. */
  readonly capped?: boolean;
}

export interface Model {
  readonly name: string;
  readonly session: string;
  readonly controls: boolean;
  readonly tissues: readonly Tissue[];
  /** Names of the joints, by row. */
  readonly joints: readonly string[];
  /** Names of the segments, likewise. */
  readonly segments: readonly string[];
}

export interface Layer {
  readonly visible: boolean;
  /** 0 to 1. */
  readonly opacity: number;
}

/** A figure of the verdict beside its limit, as a person reads it. */
export interface Figure {
  readonly name: string;
  readonly value: string;
  readonly limit: string;
  readonly over: boolean;
}

export interface Quality {
  readonly verdict: "pass" | "warn";
  readonly figures: readonly Figure[];
  readonly poseSequence: bigint;
}

/** What colours the surface beside the tissues. */
export type Scalar = "none" | "distance" | "det F" | "weight";
export type Theme = "auto" | "light" | "dark";

export interface AppState {
  readonly link: Link;
  readonly stats: Stats;
  readonly model: Model | null;
  /** One per tissue, by row. */
  readonly layers: readonly Layer[];
  /** Only these rows are shown; null: all that are visible. */
  readonly isolated: ReadonlySet<number> | null;
  /** The skin is shown at a quarter, so that what is inside is seen. */
  readonly seeThrough: boolean;
  readonly selected: number | null;
  readonly hovered: number | null;
  readonly scalar: Scalar;
  /** Row of the segment whose weights are shown. */
  readonly weightOf: number;
  readonly quality: Quality | null;
  /** The pose that is in the picture. */
  readonly poseSequence: bigint;
  readonly theme: Theme;
}

export function firstState(): AppState {
  return {
    link: { state: "connecting", reason: "", mends: true },
    stats: { framesPerSecond: 0, bytesPerSecond: 0, latencyMs: 0, level: 0, way: "frames" },
    model: null, layers: [], isolated: null, seeThrough: true, selected: null, hovered: null,
    scalar: "none", weightOf: 0, quality: null, poseSequence: 0n, theme: "auto",
  };
}
