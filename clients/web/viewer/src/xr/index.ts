// SPDX-License-Identifier: Apache-2.0
// The way into a headset: buttons where sessions are on offer, and words where not. All else is fetched when somebody enters.
import type { App } from "../app.js";
import type { Posing } from "../posing/index.js";
import { keyCaps } from "../keys.js";
import { h } from "../panels/dom.js";
import { Store } from "../state/store.js";
import { HEADSET_TRIANGLES } from "./detail.js";
import type { Headset } from "./headset.js";
import { refusal, whyNot, type Mode } from "./support.js";

interface Way {
  readonly mode: Mode;
  readonly word: string;
  readonly title: string;
  readonly key: string;
}

const WAYS: readonly Way[] = [
  { mode: "immersive-vr", word: "VR", title: "Stand before the body in a headset", key: "v" },
  { mode: "immersive-ar", word: "AR", title: "Put the body into your room", key: "Shift+v" },
];

// Without a floor the body could not stand; without hands there are controllers.
const ASKED: XRSessionInit = { requiredFeatures: ["local-floor"], optionalFeatures: ["hand-tracking"] };

export interface HeadsetState {
  /** While one is inside. */
  readonly inside: Headset | null;
  readonly mode: Mode | null;
  /** Why a mode is not on offer; empty where it is; none yet known. */
  readonly why: Readonly<Partial<Record<Mode, string>>>;
}

export class HeadsetDoor {
  readonly store = new Store<HeadsetState>({ inside: null, mode: null, why: {} });
  /** At most so many, unless one asks for all detail. */
  triangles = HEADSET_TRIANGLES;
  #entering = false;

  constructor(private readonly app: App, private readonly posing: Posing) {}

  async look(): Promise<void> {
    const [vr, ar] = await Promise.all(WAYS.map(({ mode }) => whyNot(mode)));
    this.store.set({ why: { "immersive-vr": vr!, "immersive-ar": ar! } });
  }

  offers(mode: Mode): boolean {
    return this.store.state.why[mode] === "";
  }

  /** Enters, or leaves where one is inside. */
  async toggle(mode: Mode): Promise<void> {
    const { inside } = this.store.state;
    if (inside) return inside.leave();
    if (this.#entering) return;
    if (this.app.body.bounds().isEmpty()) return this.app.say("There is no body yet to show in a headset");
    this.#entering = true;
    try {
      await this.#enter(mode);
    } catch (error) {
      this.app.say(`${wordOf(mode)} did not start: ${refusal(error)}`);
    } finally {
      this.#entering = false;
    }
  }

  async #enter(mode: Mode): Promise<void> {
    // Asked for at once: browsers grant sessions to a click, not to what follows it.
    const coming = import("./headset.js");
    const session = await navigator.xr!.requestSession(mode, ASKED);
    try {
      const { Headset } = await coming;
      const inside = await Headset.enter(this.app, this.posing, session, { inRoom: mode === "immersive-ar", triangles: this.triangles });
      this.store.set({ inside, mode });
      void inside.left.then(() => this.store.set({ inside: null, mode: null }));
    } catch (error) {
      await session.end().catch(() => {});
      throw error;
    }
  }
}

const wordOf = (mode: Mode): string => WAYS.find((way) => way.mode === mode)!.word;

const keysOf = (key: string): string => keyCaps(key).join("+");

export function addHeadset(app: App, posing: Posing): HeadsetDoor {
  const door = new HeadsetDoor(app, posing);
  const bar = app.places.root.querySelector<HTMLElement>("#tools")!;
  const divider = h("span", { class: "divider", hidden: true });
  const buttons = WAYS.map(({ mode, word, title, key }) => {
    const button = h("button", { type: "button", class: "word-button", hidden: true, data: { mode }, on: { click: () => void door.toggle(mode) } }, word);
    const show = () => {
      const inside = door.store.state.mode === mode;
      button.hidden = !door.offers(mode);
      button.setAttribute("aria-pressed", String(inside));
      button.title = `${inside ? `Leave ${word}` : title} (${keysOf(key)})`;
      divider.hidden = buttons.every((each) => each.hidden);
    };
    door.store.watch((state) => state, () => show());
    app.keys.add({ keys: [key], label: `${title}, or leave`, group: "Headset", run: () => void door.toggle(mode), when: () => door.offers(mode) });
    return button;
  });
  bar.append(divider, ...buttons);
  app.helpParts.push(() => ({
    title: "Headset",
    lines: WAYS.map(({ mode, word, key }) => {
      const why = door.store.state.why[mode];
      return `${word}: ${why === undefined ? "being looked for." : why === "" ? `on offer, by the button ${word} or the key ${keysOf(key)}.` : why}`;
    }),
  }));
  // Asked when the picture is there: some browsers wake a headset for it.
  const stop = app.live.onBody(() => {
    stop();
    void door.look();
  });
  navigator.xr?.addEventListener("devicechange", () => void door.look());
  return door;
}
