// SPDX-License-Identifier: Apache-2.0
// Vectors and unit quaternions (w, x, y, z), in double precision: what the server has, so that both tell the same angles.

export type Vec3 = readonly [number, number, number];
export type Quat = readonly [number, number, number, number];
/** Columns. */
export type Mat3 = readonly [Vec3, Vec3, Vec3];

export const IDENTITY: Quat = [1, 0, 0, 0];
export const ORIGIN: Vec3 = [0, 0, 0];

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vec3): number => Math.hypot(a[0], a[1], a[2]);

/** Null for a vector without a direction. */
export function unit(a: Vec3): Vec3 | null {
  const size = length(a);
  return size > 1e-12 ? scale(a, 1 / size) : null;
}

/** What of `a` is square to the unit vector `n`. */
export const across = (a: Vec3, n: Vec3): Vec3 => subtract(a, scale(n, dot(a, n)));

export const unitAxis = (axis: number): Vec3 => [axis === 0 ? 1 : 0, axis === 1 ? 1 : 0, axis === 2 ? 1 : 0];

export const times = (m: Mat3, v: Vec3): Vec3 => add(add(scale(m[0], v[0]), scale(m[1], v[1])), scale(m[2], v[2]));
export const transposedTimes = (m: Mat3, v: Vec3): Vec3 => [dot(m[0], v), dot(m[1], v), dot(m[2], v)];

export function multiply(a: Quat, b: Quat): Quat {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
  ];
}

export const conjugate = (q: Quat): Quat => [q[0], -q[1], -q[2], -q[3]];

export function normalized(q: Quat): Quat {
  const size = Math.hypot(q[0], q[1], q[2], q[3]);
  return size > 0 ? [q[0] / size, q[1] / size, q[2] / size, q[3] / size] : IDENTITY;
}

/** About a unit vector. */
export function turnAbout(axis: Vec3, angle: number): Quat {
  const s = Math.sin(angle / 2);
  return [Math.cos(angle / 2), axis[0] * s, axis[1] * s, axis[2] * s];
}

export function rotate(q: Quat, v: Vec3): Vec3 {
  const u: Vec3 = [q[1], q[2], q[3]];
  const t = scale(cross(u, v), 2);
  return add(add(v, scale(t, q[0])), cross(u, t));
}

/** Columns. */
export const matrixOf = (q: Quat): Mat3 => [rotate(q, [1, 0, 0]), rotate(q, [0, 1, 0]), rotate(q, [0, 0, 1])];

/** A R(q) A' as a quaternion: the vector part turns with the frame. */
export function inFrame(axes: Mat3, q: Quat): Quat {
  const v = times(axes, [q[1], q[2], q[3]]);
  return [q[0], v[0], v[1], v[2]];
}

/** Radians between two rotations, 0 to pi. */
export function angularDistance(a: Quat, b: Quat): number {
  const d = multiply(conjugate(a), b);
  return 2 * Math.atan2(Math.hypot(d[1], d[2], d[3]), Math.abs(d[0]));
}

export const DEGREES = 180 / Math.PI;

/** The same angle within half a turn of 0. */
export function wrapped(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}
