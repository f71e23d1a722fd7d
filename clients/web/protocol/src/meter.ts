// SPDX-License-Identifier: Apache-2.0
// What arrives, counted by the second, and how long a ping takes there and back.
import type { Statistics } from "./channel.js";

/** Of second(). */
const PERIOD_MS = 1000;

export class Meter {
  private frames = 0;
  private bytes = 0;
  private decodeMs = 0;
  private latencyMs = NaN;
  private askedAt: number | undefined;
  private since = performance.now();

  restart(): void {
    this.frames = this.bytes = this.decodeMs = 0;
    this.latencyMs = NaN;
    this.askedAt = undefined;
    this.since = performance.now();
  }

  received(bytes: number): void {
    this.bytes += bytes;
  }

  decoded(milliseconds: number): void {
    ++this.frames;
    this.decodeMs += milliseconds;
  }

  /** The data of a ping to send now; undefined while one is under way. */
  ask(): Uint8Array<ArrayBuffer> | undefined {
    if (this.askedAt !== undefined) return undefined;
    this.askedAt = performance.now();
    return new Uint8Array(1);
  }

  answered(): void {
    if (this.askedAt !== undefined) this.latencyMs = performance.now() - this.askedAt;
    this.askedAt = undefined;
  }

  /** Of the time since it was last called. */
  second(): Statistics {
    const now = performance.now(), seconds = Math.max((now - this.since) / 1000, 1e-3);
    const { frames, bytes, decodeMs } = this;
    // A ping that waits behind frames tells of them before it is answered.
    const latencyMs = this.askedAt === undefined ? this.latencyMs : Math.max(now - this.askedAt, this.latencyMs || 0);
    this.frames = this.bytes = this.decodeMs = 0;
    this.since = now;
    return { framesPerSecond: frames / seconds, bytesPerSecond: bytes / seconds, latencyMs, decodeMs: frames > 0 ? decodeMs / frames : 0, lagMs: Math.max(0, 1000 * seconds - PERIOD_MS) };
  }
}
