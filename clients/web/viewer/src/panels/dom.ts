// SPDX-License-Identifier: Apache-2.0
// Plain DOM, made in one line an element. Styles come from style.css alone: the page's policy refuses inline ones.

type Child = Node | string | null | undefined | false;
type Props<T extends HTMLElement> = Partial<Omit<T, "style" | "children" | "dataset">> & {
  class?: string;
  data?: Record<string, string>;
  aria?: Record<string, string | boolean>;
  on?: { [K in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[K]) => void };
  role?: string;
};

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K, props: Props<HTMLElementTagNameMap[K]> = {}, ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  const { class: name, data, aria, on, role, ...plain } = props as Props<HTMLElement>;
  if (name) element.className = name;
  if (role) element.setAttribute("role", role);
  Object.assign(element.dataset, data);
  for (const [key, value] of Object.entries(aria ?? {})) element.setAttribute(`aria-${key}`, String(value));
  for (const [type, listener] of Object.entries(on ?? {})) element.addEventListener(type, listener as EventListener);
  Object.assign(element, plain);
  element.append(...children.filter((child): child is Node | string => Boolean(child)));
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

// Drawn on 24 x 24, in lines of the text's colour.
const ICONS = {
  body: "M12 5.4a1.9 1.9 0 1 0 0-3.8 1.9 1.9 0 0 0 0 3.8M12 7.5v7M6.5 9.2 12 7.5l5.5 1.7M12 14.5 9.2 22M12 14.5l2.8 7.5",
  layers: "m12 3 9 5-9 5-9-5zM3.5 12.5 12 17l8.5-4.5M3.5 16.5 12 21l8.5-4.5",
  eye: "M2.5 12S6 5.5 12 5.5 21.5 12 21.5 12 18 18.5 12 18.5 2.5 12 2.5 12M12 15a3 3 0 1 0 0-6 3 3 0 0 0 0 6",
  eyeOff: "M4 4l16 16M9.5 6a9 9 0 0 1 2.5-.5C18 5.5 21.5 12 21.5 12a16 16 0 0 1-2.8 3.5M6 7.7A16 16 0 0 0 2.5 12S6 18.5 12 18.5a9 9 0 0 0 4-1M10 10a3 3 0 0 0 4 4",
  fit: "M4 9V5.5A1.5 1.5 0 0 1 5.5 4H9M15 4h3.5A1.5 1.5 0 0 1 20 5.5V9M20 15v3.5a1.5 1.5 0 0 1-1.5 1.5H15M9 20H5.5A1.5 1.5 0 0 1 4 18.5V15M9.5 12h5M12 9.5v5",
  focus: "M12 2v4M12 18v4M2 12h4M18 12h4M12 17a5 5 0 1 0 0-10 5 5 0 0 0 0 10",
  isolate: "M12 15.5a3.5 3.5 0 1 0 0-7 3.5 3.5 0 0 0 0 7M5 5l2 2M19 5l-2 2M5 19l2-2M19 19l-2-2",
  glass: "M12 3a9 9 0 1 0 0 18zM15 4.5v15M18 6.5v11",
  undo: "M8 5 4 9l4 4M4 9h10.5a5.5 5.5 0 0 1 0 11H10",
  redo: "m16 5 4 4-4 4M20 9H9.5a5.5 5.5 0 0 0 0 11H14",
  save: "M12 4v11M7.5 11 12 15.5 16.5 11M4.5 19.5h15",
  theme: "M12 7.5a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9M12 2v2.5M12 19.5V22M2 12h2.5M19.5 12H22M4.9 4.9l1.8 1.8M17.3 17.3l1.8 1.8M19.1 4.9l-1.8 1.8M6.7 17.3l-1.8 1.8",
  help: "M9 9a3 3 0 1 1 4.6 2.5c-1 .7-1.6 1.3-1.6 2.5M12 17.5v.1M12 21.5a9.5 9.5 0 1 0 0-19 9.5 9.5 0 0 0 0 19",
  search: "M10.5 17a6.5 6.5 0 1 0 0-13 6.5 6.5 0 0 0 0 13M15.5 15.5 20 20",
  close: "M6 6l12 12M18 6 6 18",
  chevron: "m9 6 6 6-6 6",
  check: "m5 12.5 4.5 4.5L19 7.5",
  warn: "M12 3.5 21.5 20h-19zM12 10v4.5M12 17.2v.1",
  live: "M12 13.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3M8 16a5.5 5.5 0 0 1 0-8M16 8a5.5 5.5 0 0 1 0 8M5.2 18.8a9.5 9.5 0 0 1 0-13.6M18.8 5.2a9.5 9.5 0 0 1 0 13.6",
  broken: "M4 4l16 16M8 16a5.5 5.5 0 0 1-.6-7M5.2 18.8A9.5 9.5 0 0 1 4.5 6.2M16 8a5.5 5.5 0 0 1 1 6.5M18.8 5.2a9.5 9.5 0 0 1 1.2 11.8",
  pose: "M12 5.5a1.9 1.9 0 1 0 0-3.8 1.9 1.9 0 0 0 0 3.8M12 7.5v6M5 6l7 3 6-4M12 13.5 8 22M12 13.5l5 3-1 5.5",
} as const;

export type IconName = keyof typeof ICONS;

/** An icon of the set, or a path drawn on 24 x 24. It says nothing by itself: its button has a label. */
export function icon(name: IconName | (string & {})): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", ICONS[name as IconName] ?? name);
  svg.append(path);
  return svg;
}

/** A button of an icon alone; the label is said and shown as its tip, with the key. */
export function iconButton(name: IconName | (string & {}), label: string, run: () => void, key?: string): HTMLButtonElement {
  const title = key ? `${label} (${key})` : label;
  return h("button", { type: "button", class: "icon-button", title, aria: { label }, on: { click: () => run() } }, icon(name));
}

/** Replaces the children only where the text is another, so that a screen reader is not disturbed. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}
