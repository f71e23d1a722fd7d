// SPDX-License-Identifier: Apache-2.0
// pose.yaml: reads and writes what `ecorche pose` reads and writes (docs/reference/pose.md), the same pose to the last bit.

import type { Joint, Rig } from "./rig.js";
import { findJoint } from "./rig.js";
import type { Pose } from "./pose.js";
import { restPose } from "./pose.js";
import type { Angles } from "./angles.js";
import { restAngles, rotationFromAngles } from "./angles.js";
import type { Quat, Vec3 } from "./rotation.js";
import { DEGREES } from "./rotation.js";

/** What is wrong with a file, for the person who wrote it. */
export class PoseFileError extends Error {}

type Entries = Readonly<Record<string, unknown>>;

function entries(value: unknown, where: string): Entries {
  if (value === null || value === undefined) return {};
  if (typeof value !== "object" || Array.isArray(value)) throw new PoseFileError(`${where}: write keys and values, as in \`key: value\``);
  return value as Entries;
}

function allow(map: Entries, keys: readonly string[], where: string): void {
  for (const key of Object.keys(map)) {
    if (!keys.includes(key)) throw new PoseFileError(`${where}: no key '${key}' (use ${keys.join(", ")})`);
  }
}

function numbers(value: unknown, count: number, where: string): number[] {
  const ok = Array.isArray(value) && value.length === count && value.every((x) => typeof x === "number" && Number.isFinite(x));
  if (!ok) throw new PoseFileError(`${where}: write ${count} numbers in brackets`);
  return value as number[];
}

const vector = (value: unknown, where: string): Vec3 => numbers(value, 3, where) as unknown as Vec3;

function quaternion(value: unknown, where: string): Quat {
  const q = numbers(value, 4, where) as unknown as Quat;
  const size = Math.hypot(...q);
  if (!(Math.abs(size - 1) <= 1e-3)) {
    throw new PoseFileError(`${where}: is a quaternion of length ${size} (write a unit quaternion [w, x, y, z])`);
  }
  // One that is unit to the last bits stays as it is, so that files read back exactly.
  return Math.abs(size - 1) > 1e-12 ? [q[0] / size, q[1] / size, q[2] / size, q[3] / size] : q;
}

interface JointPose {
  readonly rotation?: Quat;
  readonly translation?: Vec3;
}

function readJoint(value: unknown, joint: Joint, row: number): JointPose {
  const where = `joints.${joint.name}`;
  const map = entries(value, where);
  const angles = [...(joint.sequence.length > 0 ? restAngles(joint) : [0, 0, 0])] as [number, number, number];
  const moves = joint.kind === "free" && row !== 0;
  allow(map, ["rotation", ...joint.sequence.map((a) => `${a.name}_deg`), ...(moves ? ["translation_mm"] : [])], where);
  let turned = false;
  joint.sequence.forEach((angle, i) => {
    const degrees = map[`${angle.name}_deg`];
    if (degrees === undefined) return;
    if (typeof degrees !== "number" || !Number.isFinite(degrees)) {
      throw new PoseFileError(`${where}.${angle.name}_deg: write a number of degrees`);
    }
    angles[i] = degrees / DEGREES;
    turned = true;
  });
  if (turned && map["rotation"] !== undefined) throw new PoseFileError(`${where}: gives a rotation and angles (keep one of them)`);
  return {
    ...(turned ? { rotation: rotationFromAngles(joint, angles as Angles) } : {}),
    ...(map["rotation"] !== undefined ? { rotation: quaternion(map["rotation"], `${where}.rotation`) } : {}),
    ...(map["translation_mm"] !== undefined ? { translation: vector(map["translation_mm"], `${where}.translation_mm`) } : {}),
  };
}

/** `document`: what a YAML parser made of the file. Throws PoseFileError. */
export function poseOfDocument(document: unknown, rig: Rig): Pose {
  const file = entries(document, "pose");
  if (!("ecorche_pose" in file)) throw new PoseFileError("this is no pose file: it does not begin with ecorche_pose: 1");
  if (file["ecorche_pose"] !== 1) throw new PoseFileError(`ecorche_pose: version '${String(file["ecorche_pose"])}' is not known (1 is)`);
  allow(file, ["ecorche_pose", "skeleton", "root", "joints"], "pose");
  if (file["skeleton"] !== rig.name) {
    throw new PoseFileError(`skeleton: this pose is for the skeleton '${String(file["skeleton"])}', the model has '${rig.name}'`);
  }
  const rest = restPose(rig);
  const rotation = [...rest.rotation], translation = [...rest.translation];
  const root = entries(file["root"], "root");
  allow(root, ["translation_mm", "rotation"], "root");
  if (root["rotation"] !== undefined) rotation[0] = quaternion(root["rotation"], "root.rotation");
  for (const [name, value] of Object.entries(entries(file["joints"], "joints"))) {
    const row = findJoint(rig, name);
    if (row < 0) throw new PoseFileError(`joints: this model has no joint '${name}'`);
    if (row === 0 && root["rotation"] !== undefined) throw new PoseFileError(`joints.${name}: the root is turned twice`);
    const read = readJoint(value, rig.segments[row]!.joint, row);
    if (read.rotation) rotation[row] = read.rotation;
    if (read.translation) translation[row] = read.translation;
  }
  return {
    rootTranslation: root["translation_mm"] === undefined ? rest.rootTranslation : vector(root["translation_mm"], "root.translation_mm"),
    rotation, translation,
  };
}

/** The parser comes with the first file that is opened. */
export async function readPose(text: string, rig: Rig): Promise<Pose> {
  const { parseDocument } = await import("yaml");
  const document = parseDocument(text, { uniqueKeys: true });
  if (document.errors.length > 0) throw new PoseFileError(document.errors[0]!.message.split("\n")[0]!);
  return poseOfDocument(document.toJS({ maxAliasCount: 0 }), rig);
}

const list = (values: readonly number[]): string => `[${values.map((x) => String(x === 0 ? 0 : x)).join(", ")}]`;

// What would be read as something else than text is quoted.
const text = (name: string): string =>
  /^[a-z_][a-z0-9_]*$/i.test(name) && !/^(true|false|yes|no|on|off|null|y|n)$/i.test(name) ? name : JSON.stringify(name);

export function writePose(pose: Pose, rig: Rig): string {
  let out = `ecorche_pose: 1\nskeleton: ${text(rig.name)}\n`;
  out += `root: {translation_mm: ${list(pose.rootTranslation)}, rotation: ${list(pose.rotation[0]!)}}\n`;
  let joints = "";
  rig.segments.forEach(({ joint }, row) => {
    const rotation = pose.rotation[row]!, translation = pose.translation[row]!;
    const turned = rotation[0] !== 1 || rotation[1] !== 0 || rotation[2] !== 0 || rotation[3] !== 0;
    const moved = joint.kind === "free" && translation.some((x) => x !== 0);
    if (row === 0 || (!turned && !moved)) return;
    joints += `  ${text(joint.name)}: {rotation: ${list(rotation)}${moved ? `, translation_mm: ${list(translation)}` : ""}}\n`;
  });
  return joints === "" ? out : `${out}joints:\n${joints}`;
}
