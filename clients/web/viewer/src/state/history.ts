// SPDX-License-Identifier: Apache-2.0
// What a person did, to be undone in order: layers and poses share it.

export interface Step {
  /** What is said when it is undone: "Hide Skin". */
  readonly label: string;
  undo(): void;
  redo(): void;
  /** Steps of one key that follow within a second are one: a slider that is dragged. */
  readonly key?: string;
}

const MERGE_MS = 1000;
const LIMIT = 200;

export class History {
  #done: Step[] = [];
  #undone: Step[] = [];
  #lastPush = 0;
  #listeners = new Set<() => void>();

  constructor(private readonly now: () => number = () => performance.now()) {}

  get canUndo(): string | null {
    return this.#done.at(-1)?.label ?? null;
  }

  get canRedo(): string | null {
    return this.#undone.at(-1)?.label ?? null;
  }

  /** The step was done already. */
  push(step: Step): void {
    const last = this.#done.at(-1);
    const time = this.now();
    if (last?.key !== undefined && last.key === step.key && time - this.#lastPush < MERGE_MS) {
      this.#done[this.#done.length - 1] = { ...step, undo: () => last.undo(), redo: () => step.redo() };
    } else {
      this.#done.push(step);
      if (this.#done.length > LIMIT) this.#done.shift();
    }
    this.#lastPush = time;
    this.#undone = [];
    this.#tell();
  }

  /** Does the step and remembers it. */
  run(step: Step): void {
    step.redo();
    this.push(step);
  }

  undo(): string | null {
    const step = this.#done.pop();
    if (!step) return null;
    step.undo();
    this.#undone.push(step);
    this.#lastPush = 0;
    this.#tell();
    return step.label;
  }

  redo(): string | null {
    const step = this.#undone.pop();
    if (!step) return null;
    step.redo();
    this.#done.push(step);
    this.#lastPush = 0;
    this.#tell();
    return step.label;
  }

  /** Another model: nothing of the old one can be undone. */
  clear(): void {
    this.#done = [];
    this.#undone = [];
    this.#tell();
  }

  onChange(listener: () => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  #tell(): void {
    for (const listener of [...this.#listeners]) listener();
  }
}
