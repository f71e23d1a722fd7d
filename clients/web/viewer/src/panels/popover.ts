// SPDX-License-Identifier: Apache-2.0
// Something that opens at a button and goes when one clicks elsewhere or presses Escape: the browser's own popover, put in its place.

const GAP = 8;

export function popover(button: HTMLButtonElement, content: HTMLElement, label: string): void {
  content.popover = "auto";
  content.setAttribute("role", content.getAttribute("role") ?? "dialog");
  content.setAttribute("aria-label", label);
  button.popoverTargetElement = content;
  button.setAttribute("aria-haspopup", content.getAttribute("role") === "menu" ? "menu" : "dialog");
  button.setAttribute("aria-expanded", "false");
  content.addEventListener("toggle", (event) => {
    const open = (event as ToggleEvent).newState === "open";
    button.setAttribute("aria-expanded", String(open));
    if (open) place(button, content);
  });
}

/** Below the button, or above it where there is more room; never beyond the window. */
function place(button: HTMLElement, content: HTMLElement): void {
  const at = button.getBoundingClientRect();
  const { offsetWidth: width, offsetHeight: height } = content;
  const left = Math.max(GAP, Math.min(at.left, innerWidth - width - GAP));
  const below = at.bottom + GAP + height <= innerHeight || at.top < innerHeight / 2;
  content.style.left = `${left}px`;
  content.style.top = `${below ? at.bottom + GAP : Math.max(GAP, at.top - GAP - height)}px`;
}
