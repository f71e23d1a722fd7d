// SPDX-License-Identifier: Apache-2.0
// Where panels stand: in a dock left or right of the picture, or all in one sheet from below where there is little width. Parts of
// the viewer register theirs; each is a tab.
import type { Insets } from "../scene/stage.js";
import { h, icon, type IconName } from "./dom.js";

export interface Panel {
  readonly id: string;
  readonly title: string;
  /** Of the set in dom.ts, or a path on 24 x 24. */
  readonly icon: IconName | (string & {});
  readonly side: "left" | "right";
  /** Tabs stand in this order. */
  readonly order: number;
  /** Fills the panel, once. */
  mount(content: HTMLElement): void;
  /** It is seen now, or no more. */
  shown?(on: boolean): void;
}

interface Entry {
  readonly panel: Panel;
  readonly tab: HTMLButtonElement;
  readonly section: HTMLElement;
}

interface Dock {
  readonly root: HTMLElement;
  readonly tabs: HTMLElement;
  readonly content: HTMLElement;
  open: string | null;
}

const NARROW = "(max-width: 760px)";
// Pixels of what else stands round the picture: gaps beside a dock, the line above, the tools below.
const BESIDE = 24;
const ABOVE = 64;

export class PanelHost {
  readonly #entries: Entry[] = [];
  readonly #docks: Record<"left" | "right" | "sheet", Dock>;
  readonly #narrow = matchMedia(NARROW);

  /** `cover` is told what the docks cover of the picture. */
  constructor(root: HTMLElement, private readonly cover: (insets: Insets) => void) {
    const dock = (name: string, label: string): Dock => {
      const tabs = h("div", { class: "tabs", role: "tablist", aria: { label } });
      const content = h("div", { class: "dock-content" });
      const made = { root: h("aside", { class: "dock", data: { dock: name }, aria: { label } }, tabs, content), tabs, content, open: null };
      tabs.addEventListener("keydown", (event) => this.#tabKeys(event, tabs));
      root.append(made.root);
      return made;
    };
    this.#docks = { left: dock("left", "Body"), right: dock("right", "Posing"), sheet: dock("sheet", "Panels") };
    this.#narrow.addEventListener("change", () => this.#arrange());
    this.#arrange();
  }

  get narrow(): boolean {
    return this.#narrow.matches;
  }

  add(panel: Panel): void {
    const section = h("section", { class: "panel", hidden: true, id: `panel-${panel.id}`, role: "tabpanel", aria: { labelledby: `tab-${panel.id}` } });
    const tab = h("button", {
      type: "button", class: "tab", id: `tab-${panel.id}`, role: "tab", title: panel.title, aria: { controls: section.id, selected: false },
      on: { click: () => this.toggle(panel.id) },
    }, icon(panel.icon), h("span", {}, panel.title));
    panel.mount(section);
    this.#entries.push({ panel, tab, section });
    this.#entries.sort((a, b) => a.panel.order - b.panel.order);
    this.#arrange();
  }

  /** Shows a panel, and gives it the keyboard where asked. */
  open(id: string, focus = false): void {
    const entry = this.#entries.find(({ panel }) => panel.id === id);
    if (!entry) return;
    this.#dockOf(entry.panel).open = id;
    this.#show();
    if (focus) entry.section.querySelector<HTMLElement>("input, button, select, [tabindex='0']")?.focus();
  }

  toggle(id: string): void {
    const panel = this.#entries.find((entry) => entry.panel.id === id)?.panel;
    if (!panel) return;
    const dock = this.#dockOf(panel);
    dock.open = dock.open === id ? null : id;
    this.#show();
  }

  #dockOf(panel: Panel): Dock {
    return this.#docks[this.narrow ? "sheet" : panel.side];
  }

  #arrange(): void {
    for (const dock of Object.values(this.#docks)) {
      dock.tabs.replaceChildren();
      dock.content.replaceChildren();
    }
    for (const { panel, tab, section } of this.#entries) {
      const dock = this.#dockOf(panel);
      dock.tabs.append(tab);
      dock.content.append(section);
    }
    // At first a dock beside the picture shows its first panel; a sheet lets the picture be seen.
    for (const [name, dock] of Object.entries(this.#docks)) {
      const first = this.#entries.find(({ panel }) => this.#dockOf(panel) === dock);
      const still = this.#entries.some(({ panel }) => panel.id === dock.open && this.#dockOf(panel) === dock);
      if (!still) dock.open = name === "sheet" ? null : first?.panel.id ?? null;
      dock.root.hidden = !first;
    }
    this.#show();
  }

  #show(): void {
    for (const dock of Object.values(this.#docks)) {
      dock.root.dataset["open"] = String(dock.open !== null);
      const here = this.#entries.filter(({ panel }) => this.#dockOf(panel) === dock);
      for (const { panel, tab, section } of here) {
        const open = panel.id === dock.open;
        tab.setAttribute("aria-selected", String(open));
        tab.tabIndex = open || (dock.open === null && here[0]?.panel === panel) ? 0 : -1;
        if (section.hidden === open) {
          section.hidden = !open;
          panel.shown?.(open);
        }
      }
    }
    this.cover(this.#insets());
  }

  #insets(): Insets {
    const wide = ({ root, open }: Dock) => (this.narrow || root.hidden || open === null ? 0 : root.offsetWidth + BESIDE);
    const { left, right, sheet } = this.#docks;
    const below = this.narrow ? sheet.root.offsetHeight + BESIDE / 2 : ABOVE;
    return { left: wide(left), right: wide(right), top: ABOVE, bottom: below };
  }

  #tabKeys(event: KeyboardEvent, tabs: HTMLElement): void {
    const all = [...tabs.querySelectorAll<HTMLElement>("[role=tab]")];
    const at = all.indexOf(document.activeElement as HTMLElement);
    const steps: Record<string, number> = { ArrowRight: 1, ArrowLeft: -1, Home: -at, End: all.length - 1 - at };
    const step = steps[event.key];
    if (step === undefined || at < 0) return;
    event.preventDefault();
    all[(at + step + all.length) % all.length]!.focus();
  }
}
