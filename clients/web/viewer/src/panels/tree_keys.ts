// SPDX-License-Identifier: Apache-2.0
// The keyboard within a tree, as the ARIA practices have it: one item is in the order of tabs, arrows go on from there.

export interface TreeActions {
  /** Enter. */
  choose(item: HTMLElement): void;
  /** Space. */
  act(item: HTMLElement): void;
}

export function treeKeys(tree: HTMLElement, actions: TreeActions): void {
  const seen = () => [...tree.querySelectorAll<HTMLElement>("li:not([hidden])")]
    .filter((item) => !item.parentElement!.closest("li[aria-expanded='false'], li[hidden]"));
  const go = (item: HTMLElement | null | undefined) => {
    if (!item) return;
    for (const other of tree.querySelectorAll<HTMLElement>("li[tabindex='0']")) other.tabIndex = -1;
    item.tabIndex = 0;
    item.focus();
  };
  tree.addEventListener("focusin", (event) => {
    const item = (event.target as HTMLElement).closest<HTMLElement>("li");
    if (item && item.tabIndex !== 0) go(item);
  });
  tree.addEventListener("keydown", (event) => {
    const item = (event.target as HTMLElement).closest<HTMLElement>("li");
    if (!item || event.ctrlKey || event.metaKey || event.altKey) return;
    const items = seen(), at = items.indexOf(item);
    const parent = item.parentElement!.closest<HTMLElement>("li");
    const run: Record<string, () => void> = {
      ArrowDown: () => go(items[at + 1]),
      ArrowUp: () => go(items[at - 1]),
      Home: () => go(items[0]),
      End: () => go(items.at(-1)),
      ArrowRight: () => (item.getAttribute("aria-expanded") === "false" ? item.setAttribute("aria-expanded", "true") : !parent && go(items[at + 1])),
      ArrowLeft: () => (item.getAttribute("aria-expanded") === "true" ? item.setAttribute("aria-expanded", "false") : go(parent)),
      Enter: () => actions.choose(item),
      " ": () => actions.act(item),
    };
    const action = run[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}
