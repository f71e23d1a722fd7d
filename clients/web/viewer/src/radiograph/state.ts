// SPDX-License-Identifier: Apache-2.0
// All that the radiograph shows, in one object.
import type { Window } from "../slices/window.js";
import type { Setup, ViewId } from "./setup.js";
import { USUAL_KEV } from "./attenuation.js";

export interface RadiographState {
  readonly view: ViewId;
  /** Degrees that the source goes round the body. */
  readonly turn: number;
  /** Row of the joint that the central ray meets; null: the middle of the body. */
  readonly target: number | null;
  /** Source to detector, and size of the field on the detector, mm. */
  readonly sid: number;
  readonly width: number;
  readonly height: number;
  readonly kev: number;
  /** Source and detector go with the body; else they stay where they stand. */
  readonly follows: boolean;
  /** The beam stands in the scene. */
  readonly inScene: boolean;
  /** The server's picture is asked for whenever all rests. */
  readonly auto: boolean;
  /** null: fitted to the picture. */
  readonly window: Window | null;
  readonly inverted: boolean;
  readonly setup: Setup | null;
  /** What stands in the way of the live picture, and of the server's; empty: nothing. */
  readonly liveNote: string;
  readonly exactNote: string;
  /** The server is making one. */
  readonly asking: boolean;
}

export const firstRadiograph = (): RadiographState => ({
  view: "ap", turn: 0, target: null, sid: 1000, width: 430, height: 430, kev: USUAL_KEV, follows: true, inScene: true, auto: true,
  window: null, inverted: false, setup: null, liveNote: "", exactNote: "", asking: false,
});
