// SPDX-License-Identifier: Apache-2.0
// Distances and angles between points of the body. A point is held by where it was scanned, so that it goes with the body when that is
// posed; one that lies outside of the body stays where it is.
import { dot, length, subtract, type Vec3 } from "../posing/rotation.js";

export type MeasureKind = "distance" | "angle";

export interface MeasurePoint {
  readonly posed: Vec3;
  /** In the scan; null: it lies in no part of the body. */
  readonly rest: Vec3 | null;
}

export interface Measure {
  readonly id: number;
  readonly kind: MeasureKind;
  /** Of an angle the second is its corner. */
  readonly points: readonly MeasurePoint[];
}

export const pointsOf = (kind: MeasureKind): number => (kind === "distance" ? 2 : 3);

/** mm, or radians. NaN where an arm of the angle has no length. */
export function valueOf(kind: MeasureKind, points: readonly Vec3[]): number {
  const [a, b, c] = points as [Vec3, Vec3, Vec3];
  if (kind === "distance") return length(subtract(a, b));
  const one = subtract(a, b), other = subtract(c, b);
  return Math.acos(Math.min(1, Math.max(-1, dot(one, other) / (length(one) * length(other)))));
}

export interface Values {
  readonly posed: number;
  /** Null where a point has no place in the scan. */
  readonly scanned: number | null;
}

export function valuesOf({ kind, points }: Measure): Values {
  const rest = points.map((point) => point.rest);
  return {
    posed: valueOf(kind, points.map((point) => point.posed)),
    scanned: rest.every((point): point is Vec3 => point !== null) ? valueOf(kind, rest) : null,
  };
}

export function spell(kind: MeasureKind, value: number): string {
  return kind === "distance" ? `${value.toFixed(1)} mm` : `${(value * 180 / Math.PI).toFixed(1)}°`;
}

/** Beside it in the picture: the scanned value only where it is another. */
export function shortText(measure: Measure): string {
  const { posed, scanned } = valuesOf(measure), text = spell(measure.kind, posed);
  const before = scanned === null ? null : spell(measure.kind, scanned);
  return before === null || before === text ? text : `${text} (scan ${before})`;
}

/** Lines of a table: tabs between cells. */
export function table(measures: readonly Measure[]): string {
  const cells = (measure: Measure, row: number) => {
    const { posed, scanned } = valuesOf(measure), unit = measure.kind === "distance" ? "mm" : "deg";
    const number = (value: number) => (measure.kind === "distance" ? value : value * 180 / Math.PI).toFixed(2);
    const place = (point: Vec3 | null) => (point ? point.map((each) => each.toFixed(2)).join(" ") : "");
    return [row + 1, measure.kind, unit, number(posed), scanned === null ? "" : number(scanned),
      measure.points.map((point) => place(point.posed)).join("; "), measure.points.map((point) => place(point.rest)).join("; ")].join("\t");
  };
  return [["number", "kind", "unit", "posed", "scanned", "posed points (mm, LPS)", "scanned points (mm, LPS)"].join("\t"), ...measures.map(cells)].join("\n");
}
