// SPDX-License-Identifier: Apache-2.0
// What can colour the surface: how it is called, its scale, and how a number of it is said.
import type { Scalar } from "../state/app_state.js";

export interface ScalarKind {
  readonly label: string;
  readonly unit: string;
  /** Least and most of the scale; null: as far as the body goes. */
  readonly range: readonly [number, number] | null;
  /** Under the scale's ends, and where the middle means something under that. */
  readonly ends: readonly [string, string];
  readonly middle: string;
  readonly diverges: boolean;
  say(value: number): string;
}

export const SCALARS: Record<Exclude<Scalar, "none">, ScalarKind> = {
  distance: {
    label: "Distance from rest", unit: "mm", range: null, ends: ["0 mm", ""], middle: "", diverges: false, say: (mm) => `${mm.toFixed(1)} mm from rest`,
  },
  // Volume of a tet's surroundings over that in the scan.
  "det F": {
    label: "Local volume, posed over scanned (det F)", unit: "", range: [0, 2], ends: ["0", "2 or more"], middle: "1, as scanned", diverges: true,
    say: (share) => (share <= 0 ? "Inside out, or flat" : `${share >= 2 ? "2 or more" : share.toFixed(2)} times its scanned volume`),
  },
  weight: {
    label: "Weight of a segment", unit: "", range: [0, 1], ends: ["0", "1, follows it wholly"], middle: "", diverges: false, say: (share) => `weight ${share.toFixed(2)}`,
  },
};
