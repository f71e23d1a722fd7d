// SPDX-License-Identifier: Apache-2.0
// A limb of two segments whose upper end the border of its scan cuts, flesh and bone: a label map written by hand, and the model that ecorche makes of it.
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";

const SIZE = [24, 24, 44], SPACING = 4, MIDDLE = 11.5;
/** LPS mm: where the border cuts it, the axis' x and y, the flesh's radius, and the joint that the whole turns about. */
export const STUMP = { top: (SIZE[2]! - 0.5) * SPACING, axis: MIDDLE * SPACING, radius: 36, hip: [46, 46, 170] as const };

const CASE = `name: stump
skeleton: skeleton.yaml
bones:
  - {name: femur_right, labels: [2], segment: thigh_right}
  - {name: tibia_right, labels: [3], segment: shank_right}
labels: {file: labels.nrrd, table: {1: flesh, 2: femur, 3: tibia}}
`;
const SKELETON = `ecorche_skeleton: 1
name: knee
segments:
  thigh_right:
    joint: {name: hip_right, kind: ball, center: [${STUMP.hip.join(", ")}]}
  shank_right:
    parent: thigh_right
    joint: {name: knee_right, kind: hinge, center: [46, 46, 90], sequence: [{flexion: x}, {adduction: y}, {rotation: z}]}
`;

/** The model's file, made in `folder`. */
export function makeStump(folder: string): string {
  const program = process.env["ECORCHE_BIN"];
  if (!program) throw new Error("ECORCHE_BIN is not set (run by ctest)");
  const voxels = new Uint8Array(SIZE[0]! * SIZE[1]! * SIZE[2]!);
  for (let k = 3, at = 3 * SIZE[0]! * SIZE[1]!; k < SIZE[2]!; ++k) {
    for (let j = 0; j < SIZE[1]!; ++j) {
      for (let i = 0; i < SIZE[0]!; ++i, ++at) {
        const off = SPACING * Math.hypot(i - MIDDLE, j - MIDDLE);
        if (off < STUMP.radius) voxels[at] = off < 10 && k > 5 && k !== 22 ? (k > 22 ? 2 : 3) : 1;
      }
    }
  }
  const head = ["NRRD0004", "type: uint8", "dimension: 3", "space: left-posterior-superior", `sizes: ${SIZE.join(" ")}`, "encoding: raw",
    `space directions: (${SPACING},0,0) (0,${SPACING},0) (0,0,${SPACING})`, "space origin: (0,0,0)", "", ""].join("\n");
  fs.writeFileSync(path.join(folder, "labels.nrrd"), Buffer.concat([Buffer.from(head), voxels]));
  fs.writeFileSync(path.join(folder, "case.yaml"), CASE);
  fs.writeFileSync(path.join(folder, "skeleton.yaml"), SKELETON);
  const model = path.join(folder, "stump.hdf");
  const { status, stderr } = spawnSync(program, ["preprocess", folder, "-o", model, "--mesher", "lattice", "--max-tets", "20000"], { encoding: "utf8" });
  if (status !== 0) throw new Error(`no model of the stump: ${stderr}`);
  return model;
}
