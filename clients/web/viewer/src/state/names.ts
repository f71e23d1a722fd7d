// SPDX-License-Identifier: Apache-2.0
// Identifiers as a person reads them: `biceps_brachii_left` is "Biceps brachii, left".

const SIDES = ["left", "right"];

export function labelOf(name: string): string {
  const words = name.split("_");
  const last = words.at(-1)!;
  const side = words.length > 1 && SIDES.includes(last) ? words.pop() : undefined;
  const text = words.join(" ");
  const label = text.charAt(0).toUpperCase() + text.slice(1);
  return side ? `${label}, ${side}` : label;
}

const GROUPS: Record<string, string> = {
  skin: "Skin", bone: "Bones", muscle: "Muscles", organ: "Organs", vessel: "Vessels", nerve: "Nerves",
  cartilage: "Cartilage", ligament: "Ligaments", fat: "Fat", other: "Other",
};

export function groupLabel(group: string): string {
  return GROUPS[group] ?? labelOf(group);
}

/** The order of groups in the tree: from outside inwards, as one would dissect. */
export function groupOrder(group: string): number {
  const at = Object.keys(GROUPS).indexOf(group);
  return at < 0 ? Object.keys(GROUPS).length : at;
}

/** Every word of the query begins a word of the text, or stands within it. */
export function matches(text: string, query: string): boolean {
  const low = text.toLowerCase();
  return query.toLowerCase().split(/[\s_,]+/).filter(Boolean).every((word) => low.includes(word));
}
