// SPDX-License-Identifier: Apache-2.0
// What to ask for, by what arrives and what it costs here. Pure: numbers in, a choice out; adapt.ts applies it.
//
// The server goes by late acknowledgements, so it sees a slow line and not a slow device (MeshSelection.adaptive, which a stream
// should ask for, too). This sees the device: where a frame takes longer to decode and to draw than it may, coarser levels come
// while the body moves, and the whole one at rest.
import { Encoding } from "./gen/ecorche/v1/common_pb.js";

export interface Observed {
  framesPerSecond: number;
  bytesPerSecond: number;
  latencyMs: number;
  decodeMs: number;
  /** 0 where nobody says. */
  drawMs: number;
}

export interface Choice {
  level: number;
  encoding: Encoding;
  /** 0: every pose. */
  maxRate: number;
}

const COARSEST = 3;
/** Of one frame: 30 a second. */
const BUDGET_MS = 1000 / 30;
/** A level has four times the vertices of the next; the finer one must take this share of the budget at most. */
const PER_LEVEL = 4, ROOM = 0.6;
/** Observations, one a second, before a coarser and before a finer level; the latter doubles when finer was too much. */
const SLOW_SECONDS = 2, PATIENCE = 2, MOST_PATIENCE = 16;
/** Shares of the time that frames take, above and below which their rate is held back and let go. */
const BUSY = 0.9, AIM = 0.8, IDLE = 0.4;
const LEAST_RATE = 5, STEP = 0.25;
/** Deltas take a third of the bytes and, without SIMD, ten times the time. */
const DELTA_SHARE = 1 / 3, SLOW_DECODE_MS = 10, NEAR_MS = 5, FAR_MS = 20, LINE_BYTES_PER_SECOND = 200e6;

export class Policy {
  private level = 0;
  private encoding = Encoding.U16_DELTA;
  private maxRate = 0;
  private slow = 0;
  private fast = 0;
  private patience = PATIENCE;
  private sinceFiner = Infinity;

  /** Coarser levels are for motion. */
  choice(moving: boolean): Choice {
    return { level: moving ? this.level : 0, encoding: this.encoding, maxRate: this.maxRate };
  }

  /** Once a second while the body moves. */
  observe(observed: Observed): void {
    if (observed.framesPerSecond === 0) return;
    const cost = observed.decodeMs + observed.drawMs;
    this.chooseLevel(cost);
    this.chooseEncoding(observed);
    this.chooseRate(cost, observed.framesPerSecond);
  }

  private chooseLevel(cost: number): void {
    ++this.sinceFiner;
    this.slow = cost > BUDGET_MS ? this.slow + 1 : 0;
    this.fast = this.level > 0 && PER_LEVEL * cost < ROOM * BUDGET_MS ? this.fast + 1 : 0;
    if (this.slow >= SLOW_SECONDS && this.level < COARSEST) {
      if (this.sinceFiner <= this.patience) this.patience = Math.min(2 * this.patience, MOST_PATIENCE);
      const levels = Math.max(1, Math.round(Math.log(cost / BUDGET_MS) / Math.log(PER_LEVEL)));
      this.level = Math.min(COARSEST, this.level + levels);
      this.slow = 0;
    } else if (this.fast >= this.patience) {
      --this.level;
      this.fast = this.sinceFiner = 0;
    }
  }

  private chooseEncoding({ decodeMs, latencyMs, bytesPerSecond }: Observed): void {
    const isDelta = this.encoding === Encoding.U16_DELTA;
    if (isDelta && decodeMs > SLOW_DECODE_MS && latencyMs < NEAR_MS && bytesPerSecond < DELTA_SHARE * LINE_BYTES_PER_SECOND) {
      this.encoding = Encoding.U16;
    } else if (!isDelta && (latencyMs > FAR_MS || bytesPerSecond > LINE_BYTES_PER_SECOND)) {
      this.encoding = Encoding.U16_DELTA;
    }
  }

  private chooseRate(cost: number, framesPerSecond: number): void {
    const busy = (framesPerSecond * cost) / 1000;
    const rate = Math.max(LEAST_RATE, Math.floor((1000 * AIM) / cost));
    // Every other rate is another subscription: small steps are not worth it.
    if (busy > BUSY && Math.abs(rate - this.maxRate) > STEP * this.maxRate) this.maxRate = rate;
    else if (busy < IDLE) this.maxRate = 0;
  }
}
