// SPDX-License-Identifier: Apache-2.0
// The three planes of a reading room, as radiologists look at them: axial from the feet, coronal from the front, sagittal from the
// patient's left. The patient's left is at the right of the picture.
import type { Grid } from "../../../protocol/src/index.js";
import type { Vec3 } from "../posing/rotation.js";

export type PlaneId = "axial" | "coronal" | "sagittal";

export interface Orientation {
  readonly id: PlaneId;
  readonly title: string;
  /** Axes of LPS: across the plane, to the right of its picture, and down. */
  readonly normal: number;
  readonly right: number;
  readonly rightSign: 1 | -1;
  readonly down: number;
  readonly downSign: 1 | -1;
  /** At the left, right, upper and lower edge. */
  readonly letters: readonly [string, string, string, string];
  /** Of the side to which `normal` grows, and of the other. */
  readonly sides: readonly [string, string];
  /** sRGB: of the plane in the others' pictures and in the scene. */
  readonly color: number;
}

/** Axial red, coronal green, sagittal yellow: as 3D Slicer has them. */
export const ORIENTATIONS: readonly Orientation[] = [
  { id: "axial", title: "Axial", normal: 2, right: 0, rightSign: 1, down: 1, downSign: 1, letters: ["R", "L", "A", "P"], sides: ["H", "F"], color: 0xff5a4d },
  { id: "coronal", title: "Coronal", normal: 1, right: 0, rightSign: 1, down: 2, downSign: -1, letters: ["R", "L", "H", "F"], sides: ["P", "A"], color: 0x6fd35e },
  { id: "sagittal", title: "Sagittal", normal: 0, right: 1, rightSign: 1, down: 2, downSign: -1, letters: ["A", "P", "H", "F"], sides: ["L", "R"], color: 0xf2cf3d },
];

export const orientationOf = (id: PlaneId): Orientation => ORIENTATIONS.find((each) => each.id === id)!;

/** Where planes and their pixels may lie: at the centres of the scan's voxels, and of those that its lattice grows by. */
export interface Lattice {
  readonly origin: Vec3;
  readonly step: Vec3;
}

/** A lattice that is not along the patient's axes lends its finest spacing alone. */
export function latticeOf({ origin, spacing, direction }: Grid): Lattice {
  const from: Vec3 = [origin?.x ?? 0, origin?.y ?? 0, origin?.z ?? 0];
  const sizes = [spacing?.x ?? 1, spacing?.y ?? 1, spacing?.z ?? 1];
  const step = [0, 1, 2].map((row) => {
    const column = [0, 1, 2].find((each) => Math.abs(Math.abs(direction[3 * row + each] ?? 0) - 1) < 1e-6);
    return column === undefined ? 0 : sizes[column]!;
  });
  const along = step.every((each) => each > 0);
  const finest = Math.min(...sizes);
  return { origin: from, step: along ? step as unknown as Vec3 : [finest, finest, finest] };
}

export interface Range {
  readonly low: Vec3;
  readonly high: Vec3;
}

/** The nearest place of the lattice. */
export function snap(point: Vec3, { origin, step }: Lattice): Vec3 {
  const at = (axis: number) => origin[axis]! + step[axis]! * Math.round((point[axis]! - origin[axis]!) / step[axis]!);
  return [at(0), at(1), at(2)];
}

/** The places of the lattice round a box, with `margin` voxels to each side. */
export function fieldRound(box: Range, lattice: Lattice, margin: number): Range {
  const reach = (from: Vec3, by: number, round: (x: number) => number): Vec3 => [0, 1, 2].map((axis) => {
    const { origin, step } = lattice;
    return origin[axis]! + step[axis]! * (round((from[axis]! - origin[axis]!) / step[axis]!) + by);
  }) as unknown as Vec3;
  return { low: reach(box.low, -margin, Math.floor), high: reach(box.high, margin, Math.ceil) };
}

export const within = (inner: Range, outer: Range): boolean =>
  [0, 1, 2].every((axis) => inner.low[axis]! >= outer.low[axis]! && inner.high[axis]! <= outer.high[axis]!);

/** One plane as it is asked for: pixels at places of the lattice, the first at the upper left. */
export interface PlaneGeometry {
  readonly id: PlaneId;
  readonly origin: Vec3;
  /** mm between pixels, to the right and down. */
  readonly pixel: readonly [number, number];
  readonly width: number;
  readonly height: number;
}

const MOST_PIXELS = 4096;

/** Where a side is longer than the server takes, the middle of it. */
export function planeThrough(orientation: Orientation, cross: Vec3, field: Range, lattice: Lattice): PlaneGeometry {
  const { id, normal, right, rightSign, down, downSign } = orientation;
  const origin: number[] = [0, 0, 0];
  origin[normal] = snap(cross, lattice)[normal]!;
  const side = (axis: number, sign: number) => {
    const step = lattice.step[axis]!, all = Math.round((field.high[axis]! - field.low[axis]!) / step) + 1;
    const count = Math.min(all, MOST_PIXELS), skipped = Math.floor((all - count) / 2) * step;
    origin[axis] = sign > 0 ? field.low[axis]! + skipped : field.high[axis]! - skipped;
    return [count, step] as const;
  };
  const [width, across] = side(right, rightSign), [height, along] = side(down, downSign);
  return { id, origin: origin as unknown as Vec3, pixel: [across, along], width, height };
}

export const samePlane = (a: PlaneGeometry, b: PlaneGeometry): boolean =>
  a.id === b.id && a.width === b.width && a.height === b.height && [0, 1, 2].every((axis) => a.origin[axis] === b.origin[axis]);

/** Pixels of the plane, whole numbers at their centres, to the patient's mm. */
export function pointAt(plane: PlaneGeometry, column: number, row: number): Vec3 {
  const { right, rightSign, down, downSign } = orientationOf(plane.id);
  const point = [...plane.origin];
  point[right]! += rightSign * plane.pixel[0] * column;
  point[down]! += downSign * plane.pixel[1] * row;
  return point as unknown as Vec3;
}

/** Column and row of a point, and how far it is in front of the plane along its normal, mm. */
export function pixelOf(plane: PlaneGeometry, point: Vec3): { column: number; row: number; off: number } {
  const { normal, right, rightSign, down, downSign } = orientationOf(plane.id);
  return {
    column: rightSign * (point[right]! - plane.origin[right]!) / plane.pixel[0],
    row: downSign * (point[down]! - plane.origin[down]!) / plane.pixel[1],
    off: point[normal]! - plane.origin[normal]!,
  };
}

/** The steps of the plane's pixels, as the protocol wants them. */
export function stepsOf(plane: PlaneGeometry): { u: Vec3; v: Vec3 } {
  const { right, rightSign, down, downSign } = orientationOf(plane.id);
  const along = (axis: number, length: number) => [0, 1, 2].map((each) => (each === axis ? length : 0)) as unknown as Vec3;
  return { u: along(right, rightSign * plane.pixel[0]), v: along(down, downSign * plane.pixel[1]) };
}

/** "H 905.0 mm": to which side of the lattice's zero, and how far. */
export function position(orientation: Orientation, at: number): string {
  const value = Math.abs(at).toFixed(1);
  return `${value === "0.0" ? "" : `${orientation.sides[at > 0 ? 0 : 1]} `}${value} mm`;
}
