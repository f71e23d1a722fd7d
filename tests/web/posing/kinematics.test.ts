// SPDX-License-Identifier: Apache-2.0
// Angles, limits, couplings and places of the viewer against those of the C++ program, on random poses; and what the program does not do.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import { parse } from "yaml";
import { Client } from "../../../clients/web/protocol/src/index.js";
import { anglesFromRotation, anglesWithin, constrain, rotationFromAngles, setAngle, settable, type Angles } from "../../../clients/web/viewer/src/posing/angles.js";
import { forward, move, placeJoint } from "../../../clients/web/viewer/src/posing/forward.js";
import { counterpart, mirrorPose } from "../../../clients/web/viewer/src/posing/mirror.js";
import { restPose, samePose, withRotation, type Pose } from "../../../clients/web/viewer/src/posing/pose.js";
import { readPose, writePose } from "../../../clients/web/viewer/src/posing/pose_yaml.js";
import { presets, type Library } from "../../../clients/web/viewer/src/posing/presets.js";
import { findJoint, rigOf, type Rig } from "../../../clients/web/viewer/src/posing/rig.js";
import { limbDirections, RingDrag, ringsOf } from "../../../clients/web/viewer/src/posing/ring.js";
import { add, angularDistance, cross, DEGREES, dot, IDENTITY, length, scale, subtract, turnAbout, type Vec3 } from "../../../clients/web/viewer/src/posing/rotation.js";
import library from "../../../io/case/data/poses.yaml";
import { scratch } from "../support/page.js";
import { Server } from "../support/server.js";

const BIN = process.env["ECORCHE_BIN"]!, MODEL = process.env["ECORCHE_MODEL"]!;
const folder = scratch();
let rig: Rig, random: () => number;

before(async () => {
  rig = await rigOfModel(MODEL);
});
after(() => fs.rmSync(folder, { recursive: true, force: true }));

async function rigOfModel(model: string): Promise<Rig> {
  const server = await Server.start([], { model });
  const client = await Client.connect(server.url);
  const { skeleton } = await client.open();
  client.close();
  await server.stop();
  return rigOf(skeleton!);
}

/** Of mulberry32. */
function seeded(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** `beyond`: some angles pass their limits by up to so many radians. */
function randomPose(body: Rig, beyond: number): Pose {
  let pose = restPose(body);
  body.segments.forEach(({ joint }, row) => {
    if (row === 0 || joint.sequence.length === 0) return;
    const angles = joint.sequence.map((a, i) => {
      if (!settable(joint).includes(i)) return a.rest;
      const low = Math.max(a.min, -2.5) - beyond, high = Math.min(a.max, 2.5) + beyond;
      return low + (high - low) * random();
    }) as unknown as Angles;
    pose = withRotation(pose, row, rotationFromAngles(joint, angles));
  });
  const axis: Vec3 = [random() - 0.5, random() - 0.5, random() - 0.5];
  return { ...withRotation(pose, 0, turnAbout(scale(axis, 1 / length(axis)), random())), rootTranslation: [100 * random(), -50, 30 * random()] };
}

let files = 0;
function write(text: string): string {
  const file = path.join(folder, `file_${++files}.yaml`);
  fs.writeFileSync(file, text);
  return file;
}

function ecorche(...words: string[]): Record<string, any> {
  return JSON.parse(execFileSync(BIN, [...words, "--json"], { encoding: "utf8", maxBuffer: 1 << 26, stdio: "pipe" }));
}

/** Poses the model by words of `ecorche pose`; the report, and the folder. */
function posed(model: string, ...words: string[]): { report: Record<string, any>; out: string } {
  const out = path.join(folder, `posed_${++files}`);
  return { report: ecorche("pose", model, "-o", out, "--tissues", "none", "--volumes", "none", "--tets", ...words), out };
}

// The solver of inverse kinematics is asked for what is so already: it then changes nothing, and tells the angles of the pose after
// limits and couplings, and how far each point is from where the viewer has it.
function holdAgainstProgram(model: string, body: Rig, pose: Pose): void {
  const done = constrain(body, pose).pose, motions = forward(body, done);
  const targets = body.segments.flatMap(({ name, joint }, row) => [joint.center, add(joint.center, [40, -30, 60])].map((point) => {
    return `  - {segment: ${name}, point: [${point.join(", ")}], goal: [${move(motions[row]!, point).join(", ")}]}`;
  }));
  const start = write(writePose(pose, body));
  const ik = write(`ecorche_ik: 1\nskeleton: ${body.name}\nstart: ${path.basename(start)}\ntargets:\n${targets.join("\n")}\n`);
  const report = posed(model, "--ik", ik).report.frames[0].ik;
  for (const { name, residual_mm } of report.targets) assert.ok(residual_mm < 1e-6, `${name} is ${residual_mm} mm from where the viewer has it`);
  body.segments.forEach(({ joint }, row) => {
    if (joint.sequence.length === 0) return;
    const angles = anglesWithin(joint, done.rotation[row]!);
    joint.sequence.forEach((angle, i) => {
      const theirs = report.angles[joint.name][`${angle.name}_deg`];
      const apart = theirs - angles[i]! * DEGREES;  // half a turn this way is half a turn that way
      assert.ok(Math.abs(apart - 360 * Math.round(apart / 360)) < 1e-6, `${joint.name}.${angle.name}: ${angles[i]! * DEGREES} here, ${theirs} there`);
    });
  });
}

test("angles and places of random poses are the program's within a millionth of a degree and of a millimetre", () => {
  random = seeded(1);
  for (let i = 0; i < 4; i++) holdAgainstProgram(MODEL, rig, randomPose(rig, 0));
});

test("so are those of poses beyond the limits, and what was taken away", () => {
  random = seeded(2);
  for (let i = 0; i < 4; i++) {
    const pose = randomPose(rig, 0.6);
    holdAgainstProgram(MODEL, rig, pose);
    const { out } = posed(MODEL, "--pose", write(writePose(pose, rig)));
    const theirs = JSON.parse(fs.readFileSync(path.join(out, "quality.json"), "utf8")).clamped as { joint: string; removed_deg: number }[];
    const ours = constrain(rig, pose).clamped.map(({ joint, removed }) => ({ joint: rig.segments[joint]!.joint.name, removed: removed * DEGREES }));
    assert.deepEqual(ours.map((c) => c.joint).sort(), theirs.map((c) => c.joint).sort());
    for (const { joint, removed_deg } of theirs) assert.ok(Math.abs(ours.find((c) => c.joint === joint)!.removed - removed_deg) < 1e-6, joint);
  }
});

test("joints that follow others are where the program has them", async () => {
  random = seeded(3);
  const model = coupledModel();
  const body = await rigOfModel(model);
  const girdle = body.segments[findJoint(body, "sternoclavicular_left")]!.joint;
  assert.equal(girdle.coupled.length, 1);
  assert.equal(body.segments[findJoint(body, "knee_left")]!.joint.coupled[0]!.slideAxis, 1);
  assert.deepEqual(settable(girdle), [0, 2]);
  for (let i = 0; i < 6; i++) holdAgainstProgram(model, body, randomPose(body, 0.3));
});

/** The small patient, its girdle and knee coupled. */
function coupledModel(): string {
  const from = path.join(folder, "coupled"), model = path.join(folder, "coupled.hdf");
  execFileSync(BIN, ["phantom", "-o", from, "--size", "small"], { stdio: "pipe" });
  const file = path.join(from, "skeleton.yaml");
  const couple = (text: string, joint: string, coupling: string) => {
    assert.ok(text.includes(`name: ${joint}\n`));
    return text.replace(`name: ${joint}\n`, `name: ${joint}\n      coupled: [${coupling}]\n`);
  };
  let text = fs.readFileSync(file, "utf8");
  text = couple(text, "sternoclavicular_left", "{joint: shoulder_left, angle: adduction, drives: depression, ratio: 0.25}");
  text = couple(text, "knee_left", "{joint: knee_left, angle: flexion, drives: y_mm, ratio: -2.5}");
  fs.writeFileSync(file, text);
  execFileSync(BIN, ["preprocess", from, "-o", model, "--mesher", "lattice", "--max-tets", "40000"], { stdio: "pipe" });
  return model;
}

test("named degrees and the library are read as the program reads them", async () => {
  const named = `ecorche_pose: 1\nskeleton: ${rig.name}\njoints:\n  hip_left: {flexion_deg: 61.5, rotation_deg: -12}\n  elbow_right: {flexion_deg: 90}\n`;
  const ours = await readPose(named, rig);
  const theirs = await readPose(fs.readFileSync(path.join(posed(MODEL, "--pose", write(named)).out, "pose.yaml"), "utf8"), rig);
  assertSame(ours, theirs);
  const all = presets(parse(library) as Library, rig);
  assert.deepEqual(all.map(({ name }) => name), ["anatomical", "arms_up", "lateral", "lithotomy", "prone", "sitting", "squatting", "supine"]);
  for (const { name, pose } of all) {
    assertSame(pose, await readPose(fs.readFileSync(path.join(posed(MODEL, "--pose", `lib:${name}`).out, "pose.yaml"), "utf8"), rig));
  }
});

function assertSame(a: Pose, b: Pose): void {
  a.rotation.forEach((q, row) => assert.ok(angularDistance(q, b.rotation[row]!) < 1e-12, `${rig.segments[row]!.joint.name} differs`));
  assert.deepEqual(a.rootTranslation, b.rootTranslation);
}

test("a pose comes back from its file to the last bit", async () => {
  random = seeded(4);
  const pose = constrain(rig, randomPose(rig, 0)).pose;
  assert.deepEqual(await readPose(writePose(pose, rig), rig), pose);
});

test("files that are no poses of this body are refused in one line", async () => {
  const refused = async (text: string, why: RegExp) => assert.rejects(readPose(text, rig), (error: Error) => why.test(error.message) && !error.message.includes("\n"));
  await refused("hello", /write keys and values/);
  await refused("joints: {}", /no pose file/);
  await refused("ecorche_pose: 2", /version '2'/);
  await refused("ecorche_pose: 1\nskeleton: other", /for the skeleton 'other'/);
  const head = `ecorche_pose: 1\nskeleton: ${rig.name}\n`;
  await refused(`${head}joints: {knee_middle: {flexion_deg: 3}}`, /no joint 'knee_middle'/);
  await refused(`${head}joints: {knee_left: {flexion: 3}}`, /no key 'flexion'/);
  await refused(`${head}joints: {knee_left: {flexion_deg: much}}`, /number of degrees/);
  await refused(`${head}joints: {knee_left: {rotation: [1, 1, 0, 0]}}`, /length 1.41/);
  await refused(`${head}joints: {knee_left: {flexion_deg: 1, rotation: [1, 0, 0, 0]}}`, /a rotation and angles/);
  await refused(`${head}joints: {knee_left: {translation_mm: [1, 2, 3]}}`, /no key 'translation_mm'/);
  await refused(`${head}root: {rotation: [1, 0, 0, 0]}\njoints: {pelvis: {tilt_deg: 3}}`, /turned twice/);
  await refused(`${head}joints: {knee_left: {flexion_deg: 1}, knee_left: {flexion_deg: 2}}`, /unique/);
});

test("setting an angle keeps the others, and stops at the limit", () => {
  const row = findJoint(rig, "hip_left"), { joint } = rig.segments[row]!;
  const start = rotationFromAngles(joint, [0.5, -0.2, 0.1]);
  const set = setAngle(joint, start, 0, 1.1);
  assert.ok(anglesFromRotation(joint, set.rotation).every((a, i) => Math.abs(a - [1.1, -0.2, 0.1][i]!) < 1e-12));
  assert.equal(set.limit, null);
  const far = setAngle(joint, start, 0, 9);
  assert.equal(far.limit, joint.sequence[0]!.max);
  assert.equal(far.value, joint.sequence[0]!.max);
  assert.ok(Math.abs(anglesFromRotation(joint, far.rotation)[0] - joint.sequence[0]!.max) < 1e-12);
});

test("a mirrored pose is the mirror image, and mirrored twice it is itself", () => {
  random = seeded(5);
  const pose = randomPose(rig, 0);
  assert.ok(samePose(mirrorPose(rig, mirrorPose(rig, pose)), pose));
  // The phantom's legs are each other's image: each joint of one is where the other's would be in a mirror.
  const there = forward(rig, constrain(rig, pose).pose), here = forward(rig, constrain(rig, mirrorPose(rig, pose)).pose);
  for (const name of ["hip_left", "knee_left", "ankle_left", "toe_joint_left", "hip_right", "knee_right", "ankle_right"]) {
    const row = findJoint(rig, name), other = counterpart(rig, row);
    const [x, y, z] = move(there[row]!, rig.segments[row]!.joint.center);
    const image = move(here[other]!, rig.segments[other]!.joint.center);
    assert.ok(length(subtract(image, [-x, y, z])) < 1e-3, `${name}: ${image} is no image of ${[x, y, z]}`);
  }
});

test("rings turn about the direction about which the segment turns", () => {
  random = seeded(6);
  const pose = constrain(rig, randomPose(rig, 0)).pose, motions = forward(rig, pose);
  const small = 1e-5;
  rig.segments.forEach(({ joint, parent }, row) => {
    const placed = placeJoint(rig, pose, motions, row);
    const limbs = limbDirections(rig);
    for (const ring of ringsOf(rig, row, placed, limbs[row]!, parent < 0 ? IDENTITY : motions[parent]!.q)) {
      const more = withRotation(pose, row, rotationFromAngles(joint, placed.angles.map((a, i) => (i === ring.angle ? a + small : a)) as unknown as Angles));
      const moved = forward(rig, more)[row]!, point: Vec3 = add(joint.center, [70, 50, -90]);
      const way = scale(subtract(move(moved, point), move(motions[row]!, point)), 1 / small);
      const expected = cross(ring.axis, subtract(move(motions[row]!, point), ring.center));
      assert.ok(length(subtract(way, expected)) < 1e-2, `${joint.name}.${ring.name}`);
      assert.ok(Math.abs(dot(ring.axis, ring.handle)) < 1e-9 && Math.abs(length(ring.handle) - 1) < 1e-9);
    }
  });
});

test("a pointer that goes round a ring turns by as much, over more than a full turn", () => {
  const placed = placeJoint(rig, restPose(rig), forward(rig, restPose(rig)), 0);
  const [ring] = ringsOf(rig, 0, placed, limbDirections(rig)[0]!, IDENTITY);
  const sight = (angle: number) => {
    const place = add(ring!.center, scale(add(scale(ring!.handle, Math.cos(angle)), scale(cross(ring!.axis, ring!.handle), Math.sin(angle))), 80));
    return { from: add(place, scale(ring!.axis, 500)), along: scale(ring!.axis, -1) };
  };
  const drag = new RingDrag(ring!, sight(0.3), [0, 0], [1, 0]);
  for (let angle = 0.3; angle <= 8; angle += 0.1) assert.ok(Math.abs(drag.moved(sight(angle), [0, 0]) - (ring!.value + angle - 0.3)) < 1e-9);
  // From its edge a ring follows the pointer along its tangent: 50 pixels a radian.
  const edge = { from: add(ring!.center, scale(ring!.handle, 500)), along: scale(ring!.handle, -1) };
  assert.ok(Math.abs(new RingDrag(ring!, edge, [10, 10], [0, 50]).moved(edge, [99, 35]) - (ring!.value + 0.5)) < 1e-12);
});
