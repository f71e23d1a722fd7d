// SPDX-License-Identifier: Apache-2.0
// Anatomical angles and joint rotations, and the limits between them: the twin of core/kinematics/angles.cpp, which decides.
// tests/web holds the two against each other.

import type { AngleAxis, Joint, Rig } from "./rig.js";
import { FREE_ANGLES } from "./rig.js";
import type { Pose } from "./pose.js";
import type { Quat, Vec3 } from "./rotation.js";
import { angularDistance, conjugate, IDENTITY, matrixOf, multiply, normalized, ORIGIN, turnAbout, unitAxis, wrapped } from "./rotation.js";

/** Radians, anatomical, in the order of the joint's sequence. */
export type Angles = readonly [number, number, number];

export const turn = (angle: AngleAxis, value: number): Quat => turnAbout(unitAxis(angle.axis), angle.sign * value);

/** The three of a joint that turns (rigOf saw to it). */
const axesOf = (joint: Joint): [AngleAxis, AngleAxis, AngleAxis] => joint.sequence as unknown as [AngleAxis, AngleAxis, AngleAxis];

function intrinsic(joint: Joint, angles: Angles): Quat {
  const [a, b, c] = axesOf(joint);
  return multiply(multiply(turn(a, angles[0]), turn(b, angles[1])), turn(c, angles[2]));
}

export function restAngles(joint: Joint): Angles {
  const [a, b, c] = axesOf(joint);
  return [a.rest, b.rest, c.rest];
}

export const restTurn = (joint: Joint): Quat => intrinsic(joint, restAngles(joint));

export const rotationFromAngles = (joint: Joint, angles: Angles): Quat => multiply(conjugate(restTurn(joint)), intrinsic(joint, angles));

// With (i, j, k) the axes of the sequence and e = +1 for an even permutation of (x, y, z), -1 for an odd one,
// M = Ri(a) Rj(b) Rk(c) has M(i,k) = e sin b, M(j,k) = -e sin a cos b, M(k,k) = cos a cos b, M(i,j) = -e cos b sin c,
// M(i,i) = cos b cos c.
export function anglesFromRotation(joint: Joint, rotation: Quat): Angles {
  const columns = matrixOf(multiply(restTurn(joint), normalized(rotation)));
  const at = (row: number, column: number): number => columns[column]![row]!;
  const [first, second, third] = axesOf(joint);
  const i = first.axis, j = second.axis, k = third.axis;
  const e = (i + 1) % 3 === j ? 1 : -1;
  const cosB = Math.hypot(at(i, i), at(i, j));
  const b = Math.atan2(e * at(i, k), cosB);
  let a: number, c: number;
  if (cosB > 1e-7) {
    a = Math.atan2(-e * at(j, k), at(k, k));
    c = Math.atan2(-e * at(i, j), at(i, i));
  } else {  // a and c turn about one line: leave the third at rest
    c = third.sign * third.rest;
    const left = multiply(multiply(multiply(restTurn(joint), normalized(rotation)), turnAbout(unitAxis(k), -c)),
                          turnAbout(unitAxis(j), -b));
    const m = matrixOf(left);
    a = Math.atan2(e * m[j]![k]!, m[j]![j]!);
  }
  return [a * first.sign, b * second.sign, c * third.sign];
}

// The value of `angle + k turns` nearest to the range, moved into it. An end without limit lies at `open`: if it went on for ever,
// any angle would be within the range a few turns further.
function intoRange(range: AngleAxis, angle: number, open: number): number {
  const low = Math.min(Number.isFinite(range.min) ? range.min : -open, range.rest);
  const high = Math.max(Number.isFinite(range.max) ? range.max : open, range.rest);
  let best = angle, least = Infinity;
  for (const candidate of [angle, angle - 2 * Math.PI, angle + 2 * Math.PI]) {
    const inside = Math.min(Math.max(candidate, low), high);
    if (Math.abs(candidate - inside) >= least) continue;
    least = Math.abs(candidate - inside);
    best = inside;
  }
  return best;
}

function intoRanges(joint: Joint, angles: Angles): Angles {
  const [a, b, c] = axesOf(joint);
  return [intoRange(a, angles[0], Math.PI), intoRange(b, angles[1], Math.PI / 2), intoRange(c, angles[2], Math.PI)];
}

// The same rotation by the other triple: R(a) R(b) R(c) = R(a + pi) R(pi - b) R(c + pi).
function otherTriple(joint: Joint, angles: Angles): Angles {
  return [wrapped(angles[0] + Math.PI), wrapped(axesOf(joint)[1].sign * Math.PI - angles[1]), wrapped(angles[2] + Math.PI)];
}

const same = (a: Angles, b: Angles): boolean => a.every((x, i) => Math.abs(wrapped(x - b[i]!)) <= 1e-12);

const limited = (joint: Joint): boolean => joint.sequence.some((a) => Number.isFinite(a.min) || Number.isFinite(a.max));

function clampBall(joint: Joint, rotation: Quat): Quat {
  const first = anglesFromRotation(joint, rotation);
  const firstInside = intoRanges(joint, first);
  if (same(first, firstInside)) return rotation;
  const second = otherTriple(joint, first);
  const secondInside = intoRanges(joint, second);
  if (same(second, secondInside)) return rotation;
  const one = rotationFromAngles(joint, firstInside), two = rotationFromAngles(joint, secondInside);
  return angularDistance(one, rotation) <= angularDistance(two, rotation) ? one : two;
}

function clampUniversal(joint: Joint, rotation: Quat): Quat {
  const [a, b] = intoRanges(joint, anglesFromRotation(joint, rotation));
  const done = rotationFromAngles(joint, [a, b, axesOf(joint)[2].rest]);
  return angularDistance(done, rotation) < 1e-12 ? rotation : done;
}

// With the other angles P = R(second, rest) R(third, rest) at rest, a flexion alone is P^-1 R(axis, t) P.
function clampHinge(joint: Joint, rotation: Quat): Quat {
  const [hinge, second, third] = axesOf(joint);
  const others = multiply(turn(second, second.rest), turn(third, third.rest));
  const about = multiply(multiply(others, rotation), conjugate(others));
  const twist = 2 * Math.atan2(about[1 + hinge.axis]!, about[0]);
  const angle = intoRange(hinge, hinge.rest + hinge.sign * wrapped(twist), Math.PI);
  const done = multiply(multiply(conjugate(others), turn(hinge, angle - hinge.rest)), others);
  return angularDistance(done, rotation) < 1e-12 ? rotation : done;
}

/** What the joint can do of a rotation. */
export function clamp(joint: Joint, rotation: Quat): Quat {
  switch (joint.kind) {
    case "fixed": return IDENTITY;
    case "hinge": return clampHinge(joint, rotation);
    case "universal": return clampUniversal(joint, rotation);
    default: return limited(joint) ? clampBall(joint, rotation) : rotation;
  }
}

/** Angles within the limits that stand for the joint's rotation: of the two triples that give it, the one inside. */
export function anglesWithin(joint: Joint, rotation: Quat): Angles {
  const first = anglesFromRotation(joint, rotation);
  const firstInside = intoRanges(joint, first);
  if (same(first, firstInside)) return firstInside;
  const second = otherTriple(joint, first);
  const secondInside = intoRanges(joint, second);
  return same(second, secondInside) ? secondInside : first;
}

export interface SetAngle {
  readonly rotation: Quat;
  /** What became of the value, radians. */
  readonly value: number;
  /** The limit that held it, radians; null where none did. */
  readonly limit: number | null;
}

/** The joint's rotation with one angle set and the others as they are; the value moved into its limits. */
export function setAngle(joint: Joint, rotation: Quat, angle: number, value: number): SetAngle {
  const range = joint.sequence[angle]!;
  const low = Math.min(range.min, range.rest), high = Math.max(range.max, range.rest);
  const inside = Math.min(Math.max(value, low), high);
  const angles = anglesWithin(joint, rotation).map((a, i) => (i === angle ? inside : a)) as unknown as Angles;
  return { rotation: rotationFromAngles(joint, angles), value: inside, limit: inside === value ? null : inside };
}

/** Joints that a pose asks more of than they can do, and by how many radians. */
export interface Clamped {
  readonly joint: number;
  readonly removed: number;
}

// The driven joint's rotation with every coupled angle set.
function follow(rig: Rig, rotation: readonly Quat[], joint: Joint, own: Quat): Quat {
  const angles = [...anglesWithin(joint, own)] as [number, number, number];
  const driven = new Set<number>();
  for (const c of joint.coupled) {
    if (c.drivenAngle < 0) continue;
    const lead = rig.segments[c.joint]!.joint;
    const moved = anglesWithin(lead, rotation[c.joint]!)[c.angle]! - lead.sequence[c.angle]!.rest;
    if (!driven.has(c.drivenAngle)) angles[c.drivenAngle] = joint.sequence[c.drivenAngle]!.rest;
    driven.add(c.drivenAngle);
    angles[c.drivenAngle]! += c.ratio * moved;
  }
  return rotationFromAngles(joint, angles);
}

function slid(rig: Rig, rotation: readonly Quat[], joint: Joint): Vec3 {
  const out: [number, number, number] = [0, 0, 0];
  for (const c of joint.coupled) {
    if (c.slideAxis < 0) continue;
    const lead = rig.segments[c.joint]!.joint;
    out[c.slideAxis]! += c.ratio * (anglesWithin(lead, rotation[c.joint]!)[c.angle]! - lead.sequence[c.angle]!.rest);
  }
  return out;
}

/** What the body does of a pose: limits, then couplings. The pose that is shown, as the server makes it of the one asked for. */
export function constrain(rig: Rig, pose: Pose): { pose: Pose; clamped: readonly Clamped[] } {
  const clamped = new Map<number, number>();
  const held = (row: number, asked: Quat): Quat => {
    const done = clamp(rig.segments[row]!.joint, asked);
    const removed = angularDistance(asked, done);
    if (removed > 1e-6) clamped.set(row, Math.max(removed, clamped.get(row) ?? 0));
    return done;
  };
  const rotation: Quat[] = pose.rotation.map(normalized);
  const translation: Vec3[] = [...pose.translation];
  rig.segments.forEach(({ parent, joint }, row) => {
    if (parent < 0) return;
    rotation[row] = held(row, rotation[row]!);
    if (joint.kind !== "free") translation[row] = ORIGIN;
  });
  rig.segments.forEach(({ parent, joint }, row) => {
    if (parent < 0 || !joint.coupled.some((c) => c.drivenAngle >= 0)) return;
    rotation[row] = held(row, follow(rig, rotation, joint, rotation[row]!));
  });
  rig.segments.forEach(({ parent, joint }, row) => {
    if (parent >= 0 && joint.kind !== "free" && joint.coupled.length > 0) translation[row] = slid(rig, rotation, joint);
  });
  return {
    pose: { rootTranslation: pose.rootTranslation, rotation, translation },
    clamped: [...clamped].map(([joint, removed]) => ({ joint, removed })),
  };
}

/** The angles that a person may set, with their rows. */
export function settable(joint: Joint): readonly number[] {
  const driven = new Set(joint.coupled.map((c) => c.drivenAngle));
  return [0, 1, 2].slice(0, FREE_ANGLES[joint.kind]).filter((i) => !driven.has(i));
}
