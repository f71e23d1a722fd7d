// SPDX-License-Identifier: Apache-2.0
// One object of state and who watches parts of it. The picture and the panels are functions of it.

export class Store<S extends object> {
  #state: Readonly<S>;
  #watchers = new Set<() => void>();

  constructor(state: S) {
    this.#state = state;
  }

  get state(): Readonly<S> {
    return this.#state;
  }

  set(patch: Partial<S>): void {
    this.#state = { ...this.#state, ...patch };
    for (const watcher of [...this.#watchers]) watcher();
  }

  /** Calls `listener` whenever what `select` gives is another value, by identity; at once too with `now`. Returns the way to stop. */
  watch<T>(select: (state: Readonly<S>) => T, listener: (value: T, before: T) => void, now = false): () => void {
    let last = select(this.#state);
    const watcher = () => {
      const value = select(this.#state);
      if (Object.is(value, last)) return;
      const before = last;
      last = value;
      listener(value, before);
    };
    this.#watchers.add(watcher);
    if (now) listener(last, last);
    return () => this.#watchers.delete(watcher);
  }
}
