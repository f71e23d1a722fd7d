// SPDX-License-Identifier: Apache-2.0
// What a tissue looks like, by its group and name: colours as in an atlas of anatomy, and how they take light.

export interface Look {
  /** sRGB, 0xrrggbb. */
  readonly color: number;
  /** Where light scatters within: the colour at the border of shadow. */
  readonly scatter: number;
  /** How far light creeps round into shadow, 0 to 1. */
  readonly wrap: number;
  /** 0 is a mirror, 1 is chalk. */
  readonly roughness: number;
  /** How strongly it shines, 0 to 1: wet tissue more than skin. */
  readonly shine: number;
}

const look = (color: number, scatter: number, wrap: number, roughness: number, shine: number): Look =>
  ({ color, scatter, wrap, roughness, shine });

const GROUPS: Record<string, Look> = {
  skin: look(0xdba98c, 0xc4553a, 0.42, 0.55, 0.32),
  bone: look(0xe9dfc6, 0xb9935c, 0.22, 0.62, 0.22),
  muscle: look(0x852d28, 0x5e1110, 0.2, 0.4, 0.5),
  organ: look(0xb9705f, 0x7d2a20, 0.28, 0.36, 0.6),
  vessel: look(0xa32320, 0x640c0c, 0.25, 0.3, 0.65),
  nerve: look(0xe8cf72, 0xa97f25, 0.3, 0.45, 0.35),
  cartilage: look(0xbfd4d8, 0x6f9aa6, 0.35, 0.4, 0.45),
  ligament: look(0xdcd3b8, 0xa28f62, 0.25, 0.5, 0.3),
  fat: look(0xebcb83, 0xc08a35, 0.45, 0.5, 0.35),
  other: look(0xa9aaa6, 0x6d6f6c, 0.25, 0.55, 0.25),
};

// The first whose pattern is found in the name wins.
const ORGANS: readonly (readonly [RegExp, Look])[] = [
  [/heart|myocard|atri|ventric/, look(0xa23a37, 0x5f1010, 0.22, 0.34, 0.65)],
  [/lung/, look(0xcb918b, 0x97463f, 0.36, 0.48, 0.4)],
  [/liver/, look(0x7d3527, 0x41110a, 0.2, 0.3, 0.7)],
  [/gall/, look(0x6c8a45, 0x33480f, 0.25, 0.3, 0.7)],
  [/kidney|renal|adrenal/, look(0x8d4238, 0x4d1511, 0.22, 0.34, 0.62)],
  [/spleen/, look(0x743444, 0x3a0d1a, 0.22, 0.34, 0.62)],
  [/brain|cerebr|cerebell|medulla/, look(0xdcb8a8, 0xb26b5f, 0.35, 0.42, 0.45)],
  [/stomach|esoph|oesoph/, look(0xd09a82, 0x9a4b38, 0.35, 0.36, 0.55)],
  [/intestin|colon|bowel|duoden|rectum|jejun|ileum/, look(0xd8a68d, 0xa65d49, 0.38, 0.36, 0.55)],
  [/pancreas/, look(0xdcb27c, 0xa06b30, 0.35, 0.42, 0.45)],
  [/bladder/, look(0xd6b489, 0x9c6a3a, 0.4, 0.34, 0.55)],
  [/thyroid|thymus|prostate|uter|ovar|test/, look(0xc08072, 0x84382d, 0.3, 0.38, 0.55)],
  [/trachea|bronch|larynx/, look(0xd3cdbf, 0x8f8a72, 0.3, 0.42, 0.45)],
  [/eye/, look(0xf0ece6, 0xb59a8f, 0.3, 0.15, 0.9)],
  [/tongue/, look(0xc9716b, 0x8a2b28, 0.35, 0.35, 0.6)],
];

/** Where the border of the scan cuts the body: drawn flat, in a colour that no tissue has. */
export const CAP_COLOR = 0x8f86c4;
export const CAP_LABEL = "Cut by the scan's border";

const VEIN = look(0x44659f, 0x18305e, 0.25, 0.3, 0.65);

export function lookOf(name: string, group: string): Look {
  if (group === "vessel" && /vein|vena|venous|cava|portal|jugular/.test(name)) return VEIN;
  if (group === "organ") {
    for (const [pattern, organ] of ORGANS) if (pattern.test(name)) return organ;
  }
  if (group === "muscle") return muscleOf(name);
  return GROUPS[group] ?? GROUPS["other"]!;
}

/** Neighbouring muscles differ a little in lightness, so that their borders are seen; both sides of one muscle look alike. */
function muscleOf(name: string): Look {
  const muscle = GROUPS["muscle"]!;
  let hash = 2166136261;
  for (const letter of name.replace(/_(left|right)$/, "")) hash = Math.imul(hash ^ letter.charCodeAt(0), 16777619);
  const share = 0.86 + (((hash >>> 8) & 255) / 255) * 0.3;
  const scaled = (shift: number) => Math.min(255, Math.round(((muscle.color >> shift) & 255) * share)) << shift;
  return { ...muscle, color: scaled(16) | scaled(8) | scaled(0) };
}
