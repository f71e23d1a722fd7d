// SPDX-License-Identifier: Apache-2.0
// Dialling again after a loss, until it succeeds or cannot.
import { retryDelay } from "./backoff.js";

export interface RedialOptions {
  /** Connects, and makes all as it was. */
  restore(): Promise<void>;
  waits(reason: string, retryMs: number): void;
  isFinal(error: Error): boolean;
  givesUp(reason: string): void;
}

export class Redial {
  /** The server's wish: Goodbye.retry_seconds. */
  retrySeconds = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private stopped = false;

  constructor(private readonly options: RedialOptions) {}

  after(error: Error, tries = 0): void {
    if (this.stopped) return;
    if (this.options.isFinal(error)) return this.options.givesUp(error.message);
    const retryMs = retryDelay(tries, this.retrySeconds, Math.random());
    this.options.waits(error.message, retryMs);
    this.timer = setTimeout(() => {
      this.options.restore().then(() => { this.retrySeconds = 0; }, (failure: Error) => this.after(failure, tries + 1));
    }, retryMs);
  }

  stop(): void {
    this.stopped = true;
    clearTimeout(this.timer);
  }
}
