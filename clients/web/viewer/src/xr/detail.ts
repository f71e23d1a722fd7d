// SPDX-License-Identifier: Apache-2.0
// How many triangles a headset bears: it draws them twice, 72 to 90 times a second.

/** Standalone headsets keep their rate up to here. */
export const HEADSET_TRIANGLES = 300_000;
const COARSEST = 3;

export interface KnownLevel {
  readonly level: number;
  /** Three a triangle. */
  readonly indices: { readonly length: number };
}

/** The finest level with at most so many triangles, else the coarsest; of levels that are not known yet each has a quarter of the one before. */
export function levelWithin(most: number, known: readonly KnownLevel[]): number {
  let triangles = Infinity;
  for (let level = 0; level < COARSEST; level++) {
    const here = known.find((each) => each.level === level);
    triangles = here ? here.indices.length / 3 : triangles / 4;
    if (triangles <= most) return level;
  }
  return COARSEST;
}
