// SPDX-License-Identifier: Apache-2.0
// The chosen joint in the panel: a field for every angle that it turns by, its limits, and what one does with it. Keyboard alone does.
import type { App } from "../app.js";
import { h, icon, setText } from "../panels/dom.js";
import { settable } from "./angles.js";
import type { BodyDrag } from "./body_drag.js";
import { placeJoint } from "./forward.js";
import { typedDegrees, type Poser } from "./poser.js";
import type { Joint } from "./rig.js";
import { DEGREES, type Vec3 } from "./rotation.js";
import { angleLabel, isUnsafe, jointLabel, limitsText, oppositeOf, reachOf, spoken } from "./words.js";

/** A field of numbers: arrows step, with Shift by ten; Enter and leaving it take what is typed. */
export function numberField(id: string, step: number, unit: string, set: (value: number) => void, parse: (text: string) => number | null) {
  const input = h("input", { id, class: "number", type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false });
  const take = () => {
    const value = parse(input.value);
    if (value === null) input.setAttribute("aria-invalid", "true");
    else if (input.dataset["shown"] !== input.value) set(value);
  };
  input.addEventListener("change", take);
  input.addEventListener("keydown", (event) => {
    const steps = { ArrowUp: step, ArrowDown: -step, PageUp: 10 * step, PageDown: -10 * step }[event.key];
    if (event.key === "Enter") return take();
    if (steps === undefined) return;
    event.preventDefault();
    const from = parse(input.value);
    if (from !== null) set(from + steps * (event.shiftKey ? 10 : 1));
  });
  const show = (text: string) => {
    // What somebody types is theirs until they are done.
    if (document.activeElement === input && input.value !== input.dataset["shown"] && input.dataset["shown"] === text) return;
    input.value = input.dataset["shown"] = text;
    input.removeAttribute("aria-invalid");
  };
  return { input, show, box: h("span", { class: "number-box" }, input, h("span", { class: "unit", aria: { hidden: true } }, unit)) };
}

const typedNumber = (text: string): number | null => {
  const radians = typedDegrees(text);
  return radians === null ? null : radians * DEGREES;
};

interface AngleRow {
  readonly angle: number;
  readonly root: HTMLElement;
  show(value: number, held: boolean, live: boolean): void;
}

function angleRow(poser: Poser, row: number, joint: Joint, angle: number): AngleRow {
  const range = joint.sequence[angle]!;
  const id = `angle-${joint.name}-${range.name}`;
  const { low, high, limited } = reachOf(range);
  const field = numberField(id, 1, "°", (degrees) => poser.turn(row, angle, degrees / DEGREES), typedNumber);
  const slider = h("input", {
    type: "range", class: "angle-slider", tabIndex: -1, min: String(limited ? low * DEGREES : -180), max: String(limited ? high * DEGREES : 180), step: "0.1",
    aria: { hidden: true }, on: { input: () => poser.turn(row, angle, Number(slider.value) / DEGREES) },
  });
  const also = h("span", { class: "also" });
  const limits = h("span", { class: "limits", id: `${id}-limits` }, limitsText(range));
  field.input.setAttribute("aria-describedby", limits.id);
  const stop = h("span", { class: "stop", hidden: true }, icon("warn"), "limit");
  const root = h("div", { class: "angle", data: { axis: "xyz"[range.axis]! } },
    h("label", { htmlFor: id }, h("span", { class: "swatch" }), angleLabel(range.name)), field.box, slider, h("p", {}, also, stop, limits));
  return {
    angle, root,
    show: (value, held, live) => {
      field.show(String(Number((value * DEGREES).toFixed(1))));
      field.input.disabled = slider.disabled = !live;
      slider.value = String(value * DEGREES);
      setText(also, value < 0 && oppositeOf(range.name) ? `${spoken(range.name, value)} ` : "");
      const atEnd = limited && (value <= low + 1e-6 || value >= high - 1e-6);
      stop.hidden = !atEnd;
      root.classList.toggle("held", held && atEnd);
      const unsafe = isUnsafe(value, range);
      root.classList.toggle("unsafe", unsafe);
      limits.title = unsafe ? "Beyond its safe range the body folds, changes its volume or runs into itself (measured by ecorche calibrate)" : "";
    },
  };
}

const AXES = ["Left", "Back", "Up"] as const;

/** Rebuilt for each joint; kept up to date with the pose. */
export function addJointEditor(app: App, poser: Poser, drag: BodyDrag, content: HTMLElement): void {
  const box = h("section", { class: "joint-editor", aria: { label: "The chosen joint" } });
  content.append(box);
  let rows: AngleRow[] = [];
  let paintRest: () => void = () => {};

  const build = () => {
    const { rig, joint: row } = poser.state;
    rows = [];
    box.hidden = !rig || row === null;
    if (!rig || row === null) return;
    const { joint } = rig.segments[row]!;
    const close = h("button", { type: "button", class: "icon-button small", title: "Choose no joint (Esc)", aria: { label: "Choose no joint" }, on: { click: () => poser.select(null) } }, icon("close"));
    rows = settable(joint).map((angle) => angleRow(poser, row, joint, angle));
    const note = h("p", { class: "note", hidden: true });
    const led = joint.sequence.filter((_, i) => joint.coupled.some((c) => c.drivenAngle === i));
    const follows = led.length > 0 ? h("p", { class: "quiet" }, `${led.map((a) => angleLabel(a.name)).join(", ")}: follows ${
      [...new Set(joint.coupled.filter((c) => c.drivenAngle >= 0).map((c) => jointLabel(rig.segments[c.joint]!.joint).toLowerCase()))].join(" and ")}.`) : null;
    const button = (label: string, title: string, glyph: string, run: () => void) =>
      h("button", { type: "button", class: "text-button", title, on: { click: run } }, icon(glyph), label);
    const pin = h("button", { type: "button", class: "text-button", title: "Keep it where it is while another part is pulled (K)", on: { click: () => poser.togglePin(row) } }, icon(PIN), "Pin");
    const buttons = [button("As scanned", "This joint as it was scanned (R)", "undo", () => poser.reset(row))];
    if (poser.hasOtherSide(row)) buttons.push(button("To other side", "The joint on the other side turns alike", MIRROR, () => poser.mirrorTo(row)));
    if (row !== 0) buttons.push(pin);
    const places = placeFields(app, poser, drag, row);
    box.replaceChildren(
      h("div", { class: "chosen-head" }, h("div", {}, h("h2", {}, jointLabel(joint))), close),
      ...rows.map((each) => each.root), ...(follows ? [follows] : []), note, h("div", { class: "row-of-buttons" }, ...buttons), places.root,
    );
    paintRest = () => {
      const { controls, pins, held } = poser.state;
      const mine = held.filter((each) => each.row === row);
      note.hidden = mine.length === 0;
      setText(note, mine[0]?.text ?? "");
      pin.setAttribute("aria-pressed", String(pins.some((each) => each.segment === row)));
      for (const each of buttons) each.disabled = !controls && each !== pin;
      places.show();
    };
    paint();
  };
  const paint = () => {
    const { rig, joint: row, controls, held } = poser.state;
    if (!rig || row === null || rows.length === 0 && rig.segments[row]!.joint.kind !== "fixed") return paintRest();
    for (const each of rows) each.show(poser.angle(row, each.angle), held.some((one) => one.row === row), controls);
    paintRest();
  };
  poser.store.watch((state) => state.rig, build);
  poser.store.watch((state) => state.joint, build, true);
  poser.store.watch((state) => state, paint);
}

/** The joint's place as three numbers: the way to pull without a pointer. */
function placeFields(app: App, poser: Poser, drag: BodyDrag, row: number) {
  const where = (): Vec3 => placeJoint(poser.state.rig!, poser.state.body, poser.state.motions, row).center;
  const go = async (axis: number, value: number) => {
    if (row === 0) {
      const { rootTranslation } = poser.state.asked;
      return poser.slide(0, axis, rootTranslation[axis]! + value - where()[axis]!);
    }
    const place = where();
    const left = await drag.reach(row, place, place.map((x, i) => (i === axis ? value : x)) as unknown as Vec3);
    if (left !== null) app.say(left < 1 ? "Reached" : `${Math.round(left)} mm short: beyond reach, limits or pins`);
  };
  const fields = AXES.map((label, axis) => {
    const id = `place-${axis}`;
    const field = numberField(id, 1, "mm", (value) => void go(axis, value), typedNumber);
    return { ...field, root: h("div", { class: "place" }, h("label", { htmlFor: id }, label), field.box) };
  });
  const root = h("details", { class: "places" }, h("summary", {}, "Bring it to a place"),
    h("p", { class: "quiet" }, row === 0 ? "The whole body goes along." : "Where the joint is, in the scanner's room. The limb follows."),
    h("div", { class: "place-fields" }, ...fields.map((field) => field.root)));
  return {
    root,
    show: () => {
      const place = where();
      fields.forEach((field, axis) => {
        field.show(String(Number(place[axis]!.toFixed(1))));
        field.input.disabled = !poser.state.controls;
      });
    },
  };
}

export const PIN = "M12 14v7M8 3.5h8M9.5 3.5v5L7 12.5V14h10v-1.5l-2.5-4v-5";
export const MIRROR = "M12 3v18M9 7 3.5 17H9zM15 7l5.5 10H15z";
