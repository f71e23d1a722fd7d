// SPDX-License-Identifier: Apache-2.0
// The line is lost: says so over the last picture, counts down to the next try, and goes when the line is back.
import type { App } from "../app.js";
import { h, icon, setText } from "./dom.js";

export function addBanner(app: App): void {
  const text = h("span", {});
  const again = h("button", { type: "button", class: "text-button", on: { click: () => location.reload() } }, "Load again");
  const banner = h("div", { id: "banner", class: "float", role: "status", hidden: true }, icon("broken"), text, again);
  app.places.root.append(banner);
  let clock: ReturnType<typeof setInterval> | undefined;
  const write = () => {
    const { link } = app.store.state;
    const seconds = Math.ceil(((link.retryAt ?? 0) - Date.now()) / 1000);
    if (link.state === "closed") setText(text, link.reason);
    else setText(text, seconds > 1 ? `The line is lost. Trying again in ${seconds} s` : "The line is lost. Trying again");
  };
  app.store.watch((state) => state.link, (link, before) => {
    clearInterval(clock);
    const lost = app.live.frame !== null && link.state !== "open";
    if (!lost && !banner.hidden && before.state === "reconnecting") app.say("Connected again");
    banner.hidden = !lost;
    again.hidden = link.state !== "closed";
    if (!lost) return;
    write();
    clock = setInterval(write, 500);
  }, true);
}
