// SPDX-License-Identifier: Apache-2.0
// Whether a line bears frames, or the client should skin by itself. Pure: numbers in, a choice out; adapt.ts applies it.
//
// A slow line shows in pings that wait behind frames, while fewer frames come than the body has poses, or coarser ones, as the server
// sends them to who acknowledges late. A slow device shows neither: its worker answers pings. Skinning takes some 20 bytes a vertex
// once and 2 kB a pose from then on, so there is no way back: nothing that a line bears is better than that.

export interface LineSeen {
  framesPerSecond: number;
  /** That the body took up. */
  posesPerSecond: number;
  bytesPerSecond: number;
  latencyMs: number;
  /** Of the newest frame, beside what was asked for. */
  coarserBy: number;
  /** How long this client or the server had no processor, or worked at a pose: then waiting says nothing of the line. */
  busyMs: number;
}

const LATE_MS = 150, BUSY_MS = 60, ENOUGH_FRAMES = 30, BEHIND = 0.6, SLOW_SECONDS = 2;
/** What skinning brings must come within so long; a coarser level comes first. */
const BYTES_PER_VERTEX = 20, PATIENCE_SECONDS = 6;
const COARSEST = 3, PER_LEVEL = 4;

export class LinePolicy {
  /** Level of detail to skin; undefined: frames. */
  skins: number | undefined;
  private slow = 0;
  private most = 0;  // bytes a second

  /** `vertices`: of the whole body. `canSkin`: the server and this client can. */
  constructor(private readonly vertices: number, private readonly canSkin: boolean) {}

  /** Once a second while the body moves. */
  observe({ framesPerSecond, posesPerSecond, bytesPerSecond, latencyMs, coarserBy, busyMs }: LineSeen): void {
    if (!this.canSkin || this.skins !== undefined) return;
    const behind = framesPerSecond < BEHIND * Math.min(ENOUGH_FRAMES, posesPerSecond);
    if (!(latencyMs > LATE_MS) || busyMs > BUSY_MS || !(behind || coarserBy > 0)) {
      this.slow = this.most = 0;
      return;
    }
    this.most = Math.max(this.most, bytesPerSecond);
    if (++this.slow >= SLOW_SECONDS) this.skins = this.levelFor(this.most);
  }

  /** A second of rest: the next finer level, which comes while nothing else does. */
  rest(): void {
    if (this.skins !== undefined && this.skins > 0) --this.skins;
  }

  private levelFor(bytesPerSecond: number): number {
    let bytes = BYTES_PER_VERTEX * this.vertices;
    for (let level = 0; level < COARSEST; ++level, bytes /= PER_LEVEL) {
      if (bytes <= PATIENCE_SECONDS * bytesPerSecond) return level;
    }
    return COARSEST;
  }
}
