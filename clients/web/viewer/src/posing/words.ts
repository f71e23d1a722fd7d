// SPDX-License-Identifier: Apache-2.0
// Joints and their angles in the words that clinicians use.

import { labelOf } from "../state/names.js";
import { DEGREES } from "./rotation.js";
import type { AngleAxis, Joint, Rig } from "./rig.js";

// What the negative of an angle is called.
const OPPOSITES: Readonly<Record<string, string>> = {
  flexion: "extension", extension: "flexion", adduction: "abduction", abduction: "adduction",
  dorsiflexion: "plantarflexion", plantarflexion: "dorsiflexion", eversion: "inversion", inversion: "eversion",
  depression: "elevation", elevation: "depression", protraction: "retraction", retraction: "protraction",
};

export const jointLabel = (joint: Joint): string => labelOf(joint.name);

export const angleLabel = (name: string): string => labelOf(name);

/** 12.3 as "12.3°", whole numbers without a point; no "-0". */
export function degreesText(radians: number, digits = 1): string {
  const rounded = Number((radians * DEGREES).toFixed(digits));
  return `${String(rounded === 0 ? 0 : rounded).replace("-", "\u2212")}°`;
}

/** How far an angle goes: its limits and the scan's own value, and whether that is an end either way. */
export function reachOf({ min, max, rest }: Pick<AngleAxis, "min" | "max" | "rest">): { low: number; high: number; limited: boolean } {
  const low = Math.min(min, rest), high = Math.max(max, rest);
  return { low, high, limited: Number.isFinite(low) && Number.isFinite(high) };
}

/** An angle's limits, and where the model knows, how far the body stays one. */
export function limitsText(range: Pick<AngleAxis, "min" | "max" | "rest" | "safe">): string {
  const { low, high, limited } = reachOf(range), between = (from: number, to: number) => `${degreesText(from, 0)} to ${degreesText(to, 0)}`;
  const limits = limited ? between(low, high) : "no limit";
  return range.safe ? `${limits}, safe ${between(Math.max(low, range.safe.from), Math.min(high, range.safe.to))}` : limits;
}

/** Whether the body does not stay one at this value, as far as the model knows. */
export const isUnsafe = (value: number, { safe }: Pick<AngleAxis, "safe">): boolean => safe !== null && (value < safe.from - 1e-3 || value > safe.to + 1e-3);

/** A value with the name that fits its sign: adduction of -30 is "Abduction 30°". */
export function spoken(name: string, radians: number): string {
  const opposite = OPPOSITES[name];
  const negative = radians * DEGREES <= -0.05;
  return negative && opposite ? `${angleLabel(opposite)} ${degreesText(-radians)}` : `${angleLabel(name)} ${degreesText(radians)}`;
}

/** What the negative is called, where that is another word. */
export const oppositeOf = (name: string): string | null => OPPOSITES[name] ?? null;

export interface BodyPart {
  readonly label: string;
  /** Rows of joints that turn, from the trunk outwards. */
  readonly rows: readonly number[];
}

const PARTS: readonly (readonly [string, RegExp])[] = [
  ["Arm", /girdle|clavic|scapul|arm|hand|thumb|finger|index|middle|ring|little|wrist|elbow|shoulder/],
  ["Leg", /thigh|shank|foot|toe|patella|hip|knee|ankle/],
  ["Head and neck", /neck|head|jaw|skull/],
];

/** The joints that a person can turn, by part of the body. */
export function bodyParts(rig: Rig): readonly BodyPart[] {
  const parts = new Map<string, number[]>([["Whole body", []], ["Trunk", []], ["Head and neck", []]]);
  rig.segments.forEach((segment, row) => {
    if (segment.joint.kind === "fixed") return;
    const side = /_(left|right)$/.exec(segment.name)?.[1];
    const part = PARTS.find(([, pattern]) => pattern.test(segment.name))?.[0] ?? "Trunk";
    const label = row === 0 ? "Whole body" : side ? `${part}, ${side}` : part;
    parts.set(label, [...(parts.get(label) ?? []), row]);
  });
  return [...parts].filter(([, rows]) => rows.length > 0).map(([label, rows]) => ({ label, rows }));
}
