// SPDX-License-Identifier: Apache-2.0
// All that the slices show, in one object.
import type { Vec3 } from "../posing/rotation.js";
import type { PlaneId } from "./plane.js";
import type { Window } from "./window.js";

export type SliceTool = "cross" | "window" | "distance" | "angle";

/** What lies under the pointer. */
export interface Cursor {
  readonly plane: PlaneId;
  readonly point: Vec3;
  readonly value: number | null;
  /** As a person reads it; empty where no label is. */
  readonly tissue: string;
}

export interface SliceVolume {
  readonly name: string;
  readonly background: number;
  /** Hounsfield units, for all that one can tell: air lies outside the body. */
  readonly hounsfield: boolean;
}

export interface SliceState {
  readonly open: boolean;
  /** That can be shown in greys. */
  readonly volumes: readonly SliceVolume[];
  /** Names; null: none. */
  readonly volume: string | null;
  readonly labels: string | null;
  readonly cross: Vec3;
  readonly window: Window;
  /** Of the labels, 0 to 1. */
  readonly overlay: number;
  readonly smooth: boolean;
  /** The planes stand in the body, too. */
  readonly inBody: boolean;
  readonly tool: SliceTool;
  /** One plane in place of all; null: all three beside the body. */
  readonly whole: PlaneId | null;
  readonly cursor: Cursor | null;
  /** The pose that the planes show. */
  readonly poseSequence: bigint;
}

export const firstSlices = (): SliceState => ({
  open: false, volumes: [], volume: null, labels: null, cross: [0, 0, 0], window: { level: 40, width: 400 }, overlay: 0.35, smooth: true,
  inBody: true, tool: "cross", whole: null, cursor: null, poseSequence: 0n,
});
