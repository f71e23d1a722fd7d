// SPDX-License-Identifier: Apache-2.0
// Keys and what they do: one table, which the help lists.

export interface KeyBinding {
  /** As KeyboardEvent.key names it, after "Ctrl+" (Command on a Mac) and "Shift+"; Shift is not named for signs that need it. */
  readonly keys: readonly string[];
  readonly label: string;
  /** Heading in the help. */
  readonly group: string;
  run(): void;
  /** False: not now, the key goes on to others. */
  when?(): boolean;
}

const EDITED = "input:not([type=checkbox]):not([type=radio]):not([type=range]):not([type=button]), textarea, select, [contenteditable]";

export class Keys {
  readonly #bindings: KeyBinding[] = [];

  constructor(target: EventTarget = window) {
    target.addEventListener("keydown", (event) => this.#press(event as KeyboardEvent));
  }

  get bindings(): readonly KeyBinding[] {
    return this.#bindings;
  }

  add(...bindings: KeyBinding[]): void {
    this.#bindings.push(...bindings);
  }

  #press(event: KeyboardEvent): void {
    if (event.defaultPrevented || event.altKey) return;
    const focused = event.target instanceof Element ? event.target : null;
    const command = event.ctrlKey || event.metaKey;
    if (focused?.matches(EDITED) && event.key !== "Escape") return;
    // What is open over the page has the keys, and closes by Escape without help.
    if (document.querySelector("dialog[open], [popover]:popover-open")) return;
    // Arrows and Enter belong to what is focused, where that is a control; a letter never does.
    if (event.key.length > 1 && event.key !== "Escape" && focused?.closest("button, a, input, [role=tree], [role=tablist], [role=slider]")) return;
    const plain = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const named = `${command ? "Ctrl+" : ""}${event.shiftKey && (plain.length > 1 || /[a-z]/.test(plain)) ? "Shift+" : ""}${plain}`;
    // The last one added is asked first, as with tools.
    const binding = [...this.#bindings].reverse().find((each) => each.keys.includes(named) && (each.when?.() ?? true));
    if (!binding) return;
    event.preventDefault();
    binding.run();
  }
}

const SIGNS: Record<string, string> = { ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", Escape: "Esc", " ": "Space" };

/** "Ctrl+Shift+z" as one reads it on a keyboard: ["Ctrl", "Shift", "Z"]. */
export function keyCaps(keys: string): string[] {
  const parts = keys === "+" ? ["+"] : keys.split("+");
  return parts.map((part) => SIGNS[part] ?? (part.length === 1 ? part.toUpperCase() : part));
}
