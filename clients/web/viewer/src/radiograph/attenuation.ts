// SPDX-License-Identifier: Apache-2.0
// How strongly tissues attenuate X-rays of one energy: the twin of runtime/radiograph/attenuation.cpp (docs/reference/radiograph.md).

export const LEAST_KEV = 20;
export const MOST_KEV = 150;
export const USUAL_KEV = 60;

// keV; of water and of cortical bone, cm2/g.
const TABLE: readonly (readonly [number, number, number])[] = [
  [20, 0.8096, 4.001], [30, 0.3756, 1.331], [40, 0.2683, 0.6655], [50, 0.2269, 0.4242],
  [60, 0.2059, 0.3148], [80, 0.1837, 0.2229], [100, 0.1707, 0.1855], [150, 0.1505, 0.148],
];
const BONE_DENSITY = 1.92;
// Of a scanner at 120 kV, filtered.
const SCANNER_KEV = 70;

/** 1/mm. */
function coefficients(kev: number): { water: number; bone: number } {
  const above = Math.max(1, TABLE.findIndex((row, i) => i > 0 && (row[0] >= kev || i === TABLE.length - 1)));
  const low = TABLE[above - 1]!, high = TABLE[above]!;
  const share = Math.log(kev / low[0]) / Math.log(high[0] / low[0]);
  const between = (a: number, b: number) => a * (b / a) ** share;
  return { water: between(low[1], high[1]) / 10, bone: (between(low[2], high[2]) * BONE_DENSITY) / 10 };
}

/** Of Hounsfield units, 1/mm. */
export function attenuationOf(hu: number, kev: number): number {
  if (!(hu > -1000)) return 0;
  const here = coefficients(kev), scanner = coefficients(SCANNER_KEV);
  if (hu <= 0) return here.water * (1 + hu / 1000);
  return here.water + (hu * (here.bone - here.water)) / (1000 * (scanner.bone / scanner.water - 1));
}

const NOMINAL: Record<string, number> = { bone: 700, cartilage: 100, ligament: 80, muscle: 50, fat: -100 };

/** What a tissue is taken for, Hounsfield units. */
export function nominalHu(name: string, group: string): number {
  if (group === "organ" && name.startsWith("lung")) return -750;
  if (group === "organ" && name.startsWith("trachea")) return -1000;
  return NOMINAL[group] ?? 40;
}

/** What a tissue attenuates beyond the soft tissue that it lies in, 1/mm; the skin, which holds all others, as much as that. */
export function beyondSoft(name: string, group: string, kev: number): number {
  const soft = attenuationOf(nominalHu("", "skin"), kev);
  return group === "skin" ? soft : attenuationOf(nominalHu(name, group), kev) - soft;
}
