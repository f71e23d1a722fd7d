// SPDX-License-Identifier: Apache-2.0
// When to dial again. Never all at once: where a server stops, all of its clients come back.

const FIRST_MS = 250, MOST_MS = 15_000;

/** The wait before try `tries` (0: the first after a loss), milliseconds. `random`: 0 to 1. */
export function retryDelay(tries: number, retrySeconds: number, random: number): number {
  if (retrySeconds > 0 && tries === 0) return 1000 * retrySeconds * (1 + random);  // as Goodbye says
  const most = Math.min(MOST_MS, FIRST_MS * 2 ** tries);
  return most * (0.5 + 0.5 * random);
}
