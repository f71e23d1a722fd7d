// SPDX-License-Identifier: Apache-2.0
// The tissue tree: groups and their tissues, searched, shown and hidden, chosen; below it what one does with the chosen one.
import type { App } from "../app.js";
import type { Tissue } from "../state/app_state.js";
import { CAP_COLOR, CAP_LABEL, lookOf } from "../scene/palette.js";
import { groupLabel, groupOrder, matches } from "../state/names.js";
import { addSurface } from "./surface.js";
import { addChosen } from "./chosen.js";
import { h, icon, iconButton } from "./dom.js";
import { treeKeys } from "./tree_keys.js";

interface Row {
  readonly item: HTMLLIElement;
  readonly eye: HTMLButtonElement;
  readonly rows: readonly number[];
  readonly name: string;
}

export function addTissues(app: App): void {
  app.panels.add({ id: "tissues", title: "Tissues", icon: "layers", side: "left", order: 0, mount: (content) => mount(app, content) });
}

function mount(app: App, content: HTMLElement): void {
  const search = h("input", { type: "search", id: "tissue-search", placeholder: "Search", autocomplete: "off", aria: { label: "Search tissues" } });
  const tree = h("ul", { class: "tree", role: "tree", aria: { label: "Tissues" } });
  const none = h("p", { class: "none", hidden: true }, "No tissue has such a name.");
  const cut = h("p", { class: "cut", hidden: true }, swatchOf(CAP_COLOR), CAP_LABEL);
  const seeThrough = h("button", { type: "button", class: "text-button", title: "See through the skin (S)", on: { click: () => app.layers.toggleSeeThrough() } }, icon("glass"), "See through");
  const all = h("button", { type: "button", class: "text-button", title: "Show all tissues (A)", on: { click: () => app.layers.showAll() } }, icon("eye"), "Show all");
  content.append(h("div", { class: "search" }, icon("search"), search), h("div", { class: "row-of-buttons" }, seeThrough, all),
    h("div", { class: "tree-box" }, tree, none, cut));
  addChosen(app, content);
  addSurface(app, content);

  let leaves = new Map<number, Row>();
  let groups: Row[] = [];
  const paint = () => {
    const { layers, isolated, seeThrough: on } = app.store.state;
    seeThrough.setAttribute("aria-pressed", String(on));
    const shown = (row: number) => (isolated ? isolated.has(row) : layers[row]?.visible ?? true);
    for (const { rows, eye, item, name } of [...leaves.values(), ...groups]) {
      const count = rows.filter(shown).length;
      item.dataset["shown"] = count === 0 ? "none" : count === rows.length ? "all" : "some";
      eye.setAttribute("aria-label", `${count > 0 ? "Hide" : "Show"} ${name}`);
      eye.replaceChildren(icon(count > 0 ? "eye" : "eyeOff"));
    }
  };
  const choose = () => {
    const { selected } = app.store.state;
    for (const [row, { item }] of leaves) item.setAttribute("aria-selected", String(row === selected));
    const leaf = selected === null ? undefined : leaves.get(selected);
    if (!leaf) return;
    leaf.item.parentElement!.closest("li")?.setAttribute("aria-expanded", "true");
    setCurrent(tree, leaf.item);
    leaf.item.scrollIntoView({ block: "nearest" });
  };
  const filter = () => {
    let found = 0;
    for (const group of groups) {
      const label = group.name;
      const inside = [...leaves.values()].filter(({ item }) => group.item.contains(item));
      const hits = inside.filter(({ item, name }) => {
        const hit = matches(`${name} ${label}`, search.value);
        item.hidden = !hit;
        return hit;
      });
      group.item.hidden = hits.length === 0;
      if (search.value && hits.length > 0) group.item.setAttribute("aria-expanded", "true");
      found += hits.length;
    }
    none.hidden = found > 0;
  };
  const build = (tissues: readonly Tissue[]) => {
    leaves = new Map();
    groups = [];
    const byGroup = new Map<string, Tissue[]>();
    for (const tissue of tissues) byGroup.set(tissue.group, [...(byGroup.get(tissue.group) ?? []), tissue]);
    const sorted = [...byGroup].sort(([a], [b]) => groupOrder(a) - groupOrder(b));
    tree.replaceChildren(...sorted.map(([group, members]) => {
      const items = [...members].sort((a, b) => a.label.localeCompare(b.label)).map((tissue) => {
        const row = leaf(app, tissue);
        leaves.set(tissue.row, row);
        return row.item;
      });
      const row = branch(app, group, members, items, sorted.length === 1);
      groups.push(row);
      return row.item;
    }));
    const first = tree.querySelector<HTMLElement>("li");
    if (first) first.tabIndex = 0;
    cut.hidden = !tissues.some(({ capped }) => capped);
    filter();
    paint();
    choose();
  };
  search.addEventListener("input", filter);
  search.addEventListener("keydown", (event) => {
    if (event.key === "ArrowDown") {
      event.preventDefault();
      tree.querySelector<HTMLElement>("li:not([hidden])")?.focus();
    } else if (event.key === "Escape" && search.value) {
      event.stopPropagation();
      search.value = "";
      filter();
    }
  });
  treeKeys(tree, {
    choose: (item) => (item.dataset["row"] ? app.select(Number(item.dataset["row"])) : toggle(item)),
    act: (item) => item.querySelector<HTMLButtonElement>(".eye")!.click(),
  });
  app.store.watch((state) => state.model?.tissues, (tissues) => build(tissues ?? []), true);
  app.store.watch((state) => state.layers, paint);
  app.store.watch((state) => state.isolated, paint);
  app.store.watch((state) => state.seeThrough, paint);
  app.store.watch((state) => state.selected, choose);
}

function toggle(item: HTMLElement): void {
  item.setAttribute("aria-expanded", String(item.getAttribute("aria-expanded") !== "true"));
}

function setCurrent(tree: HTMLElement, item: HTMLElement): void {
  for (const other of tree.querySelectorAll<HTMLElement>("li[tabindex='0']")) other.tabIndex = -1;
  item.tabIndex = 0;
}

function eyeButton(app: App, rows: readonly number[]): HTMLButtonElement {
  const eye = iconButton("eye", "", () => {
    const { layers, isolated } = app.store.state;
    const anyShown = rows.some((row) => (isolated ? isolated.has(row) : layers[row]?.visible));
    if (isolated) app.layers.isolate(anyShown ? [...isolated].filter((row) => !rows.includes(row)) : [...isolated, ...rows]);
    else app.layers.setVisible(rows, !anyShown);
  });
  eye.classList.add("small", "eye");
  eye.removeAttribute("title");
  eye.tabIndex = -1;
  eye.addEventListener("click", (event) => event.stopPropagation());
  return eye;
}

function swatchOf(color: number): HTMLElement {
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = `#${color.toString(16).padStart(6, "0")}`;
  return swatch;
}

function leaf(app: App, tissue: Tissue): Row {
  const eye = eyeButton(app, [tissue.row]);
  const swatch = swatchOf(lookOf(tissue.name, tissue.group).color);
  const item = h("li", {
    role: "treeitem", tabIndex: -1, data: { row: String(tissue.row) }, aria: { selected: false, level: "2" },
    on: {
      click: (event) => { event.stopPropagation(); app.select(tissue.row); },
      dblclick: (event) => { event.stopPropagation(); app.focusSelected(); },
      mouseenter: () => app.store.set({ hovered: tissue.row }),
      mouseleave: () => app.store.set({ hovered: null }),
    },
  }, h("div", { class: "line" }, swatch, h("span", { class: "name" }, tissue.label), eye));
  return { item, eye, rows: [tissue.row], name: tissue.label };
}

function branch(app: App, group: string, members: readonly Tissue[], items: readonly HTMLLIElement[], expanded: boolean): Row {
  const rows = members.map(({ row }) => row);
  const eye = eyeButton(app, rows);
  const name = groupLabel(group);
  const item = h("li", { role: "treeitem", tabIndex: -1, aria: { expanded, level: "1" }, on: { click: () => toggle(item) } },
    h("div", { class: "line group" }, icon("chevron"), h("span", { class: "name" }, name), h("span", { class: "count" }, String(members.length)), eye),
    h("ul", { role: "group" }, ...items));
  return { item, eye, rows, name };
}
