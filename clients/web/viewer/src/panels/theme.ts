// SPDX-License-Identifier: Apache-2.0
// Light or dark: as the system says, until a person says otherwise.
import type { App } from "../app.js";
import type { Surroundings } from "../scene/stage.js";
import type { Theme } from "../state/app_state.js";

const KEY = "ecorche.theme";
const SURROUNDINGS: Record<"light" | "dark", Surroundings> = {
  light: { above: 0xf7f5f1, below: 0xcfcbc3, shadow: 0x3a332c, accent: 0x0b63c4 },
  dark: { above: 0x3a4048, below: 0x111418, shadow: 0x000000, accent: 0x7dbbff },
};
const NEXT: Record<Theme, Theme> = { auto: "light", light: "dark", dark: "auto" };
const SAID: Record<Theme, string> = { auto: "Light or dark as the system is", light: "Light", dark: "Dark" };

export function addTheme(app: App): void {
  const system = matchMedia("(prefers-color-scheme: dark)");
  const update = () => {
    const { theme } = app.store.state;
    const shown = theme === "auto" ? (system.matches ? "dark" : "light") : theme;
    document.documentElement.dataset["theme"] = shown;
    app.body.shared.accent.value.set(SURROUNDINGS[shown].accent);
    app.stage.surround(SURROUNDINGS[shown]);
  };
  const kept = localStorage.getItem(KEY);
  if (kept === "light" || kept === "dark") app.store.set({ theme: kept });
  system.addEventListener("change", update);
  app.store.watch((state) => state.theme, update, true);
}

export function nextTheme(app: App): void {
  const theme = NEXT[app.store.state.theme];
  localStorage.setItem(KEY, theme);
  app.store.set({ theme });
  app.say(SAID[theme]);
}
