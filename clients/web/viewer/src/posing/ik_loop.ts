// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics while a pointer moves: one request on its way, and of the targets that come meanwhile only the newest.

/** Asks the server for one target; resolves with what it found. */
export type Solve<Target, Found> = (target: Target) => Promise<Found>;

export class IkLoop<Target, Found> {
  #running = false;
  #next: { target: Target } | null = null;
  #over = false;
  #idle: (() => void)[] = [];

  constructor(
    private readonly solve: Solve<Target, Found>,
    private readonly found: (found: Found, target: Target) => void,
    private readonly failed: (error: Error) => void,
  ) {}

  aim(target: Target): void {
    if (this.#over) return;
    this.#next = { target };
    if (!this.#running) void this.#run();
  }

  /** What is under way is no longer told. */
  stop(): void {
    this.#over = true;
    this.#next = null;
  }

  /** When the newest target has been answered. */
  settled(): Promise<void> {
    return this.#running ? new Promise((resolve) => this.#idle.push(resolve)) : Promise.resolve();
  }

  async #run(): Promise<void> {
    this.#running = true;
    while (this.#next) {
      const { target } = this.#next;
      this.#next = null;
      try {
        const found = await this.solve(target);
        if (!this.#over) this.found(found, target);
      } catch (error) {
        if (!this.#over) this.failed(error instanceof Error ? error : new Error(String(error)));
        this.stop();
      }
    }
    this.#running = false;
    for (const resolve of this.#idle.splice(0)) resolve();
  }
}
