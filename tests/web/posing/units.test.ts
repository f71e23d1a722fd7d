// SPDX-License-Identifier: Apache-2.0
// Posing without a server: undo, links, saved poses, requests of inverse kinematics, what is typed, who may pose.
import assert from "node:assert/strict";
import { test } from "node:test";
import { BodyDrag, type IkTarget } from "../../../clients/web/viewer/src/posing/body_drag.js";
import { positionNow } from "../../../clients/web/viewer/src/posing/clips.js";
import { IkLoop } from "../../../clients/web/viewer/src/posing/ik_loop.js";
import { linkFragment, readLink } from "../../../clients/web/viewer/src/posing/link.js";
import { apart } from "../../../clients/web/viewer/src/posing/overlay.js";
import { standing } from "../../../clients/web/viewer/src/posing/people_panel.js";
import { restPose, samePose, withRotation, wireOf, type Pose } from "../../../clients/web/viewer/src/posing/pose.js";
import { Poser, typedDegrees } from "../../../clients/web/viewer/src/posing/poser.js";
import { rigOf, type Rig } from "../../../clients/web/viewer/src/posing/rig.js";
import { DEGREES, turnAbout } from "../../../clients/web/viewer/src/posing/rotation.js";
import { SavedPoses } from "../../../clients/web/viewer/src/posing/saved_poses.js";
import { bodyParts, degreesText, isUnsafe, limitsText, spoken } from "../../../clients/web/viewer/src/posing/words.js";
import { History } from "../../../clients/web/viewer/src/state/history.js";

const at = (x: number, y: number, z: number) => ({ x, y, z });
const joint = (name: string, z: number, min: number, max: number) => ({
  name, kind: 2, center: at(0, 0, z), axisX: at(1, 0, 0), axisY: at(0, 1, 0), axisZ: at(0, 0, 1),
  sequence: [{ name: "flexion", axis: 0, negative: false, rest: 0, min, max }, { name: "adduction", axis: 1, negative: false, rest: 0, min: 0, max: 0 },
             { name: "rotation", axis: 2, negative: false, rest: 0, min: 0, max: 0 }],
});
const SKELETON = {
  name: "leg",
  segments: [
    { name: "pelvis", parent: -1, joint: { ...joint("root", 900, -Infinity, Infinity), kind: 5 } },
    { name: "thigh_left", parent: 0, joint: joint("hip_left", 850, -0.5, 2) },
    { name: "shank_left", parent: 1, joint: joint("knee_left", 450, 0, 2.4) },
  ],
};
const rig: Rig = rigOf(SKELETON);

test("a ring shows where the body stays one: up to the first thing that goes wrong, or as far as was looked", () => {
  const range = { joint: 2, angle: 0, negative: false, looked: 2.4, correctedInverted: 1.4, correctedVolume: Infinity, bones: 1.9 };
  const safe = rigOf(SKELETON, [range, { ...range, negative: true, looked: 0.1, correctedInverted: Infinity, bones: Infinity },
                                { ...range, joint: 1, angle: 2 }]);
  const [hip, knee] = safe.segments.slice(1);
  assert.deepEqual(knee!.joint.sequence[0]!.safe, { from: -0.1, to: 1.4 });
  assert.deepEqual(hip!.joint.sequence[2]!.safe, { from: 0, to: 1.4 });
  const touching = rigOf(SKELETON, [{ ...range, correctedContact: 1.2 }, { ...range, negative: true, correctedContact: Infinity }]);
  assert.deepEqual(touching.segments[2]!.joint.sequence[0]!.safe, { from: -1.4, to: 1.2 });
  assert.equal(hip!.joint.sequence[0]!.safe, null);
  assert.equal(rig.segments[2]!.joint.sequence[0]!.safe, null);

  // In words, within the limits; and where a value lies beyond.
  const bend = knee!.joint.sequence[0]!;
  assert.equal(limitsText(bend), "0° to 138°, safe 0° to 80°");
  assert.equal(limitsText(rig.segments[2]!.joint.sequence[0]!), "0° to 138°");
  assert.equal(limitsText({ min: -Infinity, max: Infinity, rest: 0, safe: null }), "no limit");
  assert.deepEqual([1.39, 1.41, -0.09, -0.11].map((value) => isUnsafe(value, bend)), [false, true, false, true]);
  assert.equal(isUnsafe(3, rig.segments[2]!.joint.sequence[0]!), false);
});

function poser(controls = true) {
  const sent: ReturnType<typeof wireOf>[] = [], said: string[] = [], history = new History();
  const made = new Poser(history, { setPose: (pose) => sent.push(pose) }, (text) => said.push(text));
  made.open(rig, { rotation: [] }, controls);
  return { poser: made, sent, said, history };
}

test("a step is sent, undone and done again; steps of one field in a row are one", () => {
  let now = 0;
  const sent: unknown[] = [], history = new History(() => now);
  const made = new Poser(history, { setPose: (pose) => sent.push(pose) }, () => {});
  made.open(rig, { rotation: [] }, true);
  made.turn(2, 0, 0.3);
  now = 100;
  made.turn(2, 0, 0.6);
  now = 5000;
  made.turn(1, 0, 0.2);
  assert.equal(sent.length, 3);
  assert.equal(history.undo(), "Hip, left: Flexion 11.5°");
  assert.ok(Math.abs(made.angle(2, 0) - 0.6) < 1e-12 && Math.abs(made.angle(1, 0)) < 1e-12);
  history.undo();
  assert.ok(samePose(made.state.asked, restPose(rig)));
  assert.equal(history.canUndo, null);
  history.redo();
  assert.ok(Math.abs(made.angle(2, 0) - 0.6) < 1e-12);
});

test("a gesture of many poses is one step, and taken back it is none", () => {
  const { poser: made, history, sent } = poser();
  assert.ok(made.begin());
  for (let i = 1; i <= 5; i++) made.show(withRotation(restPose(rig), 2, turnAbout([1, 0, 0], 0.1 * i)));
  made.commit("Turn");
  assert.equal(sent.length, 5);
  assert.equal(history.undo(), "Turn");
  assert.ok(samePose(made.state.asked, restPose(rig)));
  made.begin();
  made.show(withRotation(restPose(rig), 2, turnAbout([1, 0, 0], 1)));
  made.cancel();
  assert.equal(history.canUndo, null);
  assert.ok(samePose(made.state.asked, restPose(rig)));
});

test("a limit is said", () => {
  const { poser: made, said } = poser();
  assert.equal(made.turn(2, 0, 3), 2.4);
  assert.match(said.at(-1)!, /^Knee, left: flexion stops at 137.5°, its limit$/);
  assert.match(made.state.held[0]!.text, /its limit/);
  made.turn(2, 0, 1);
  assert.deepEqual(made.state.held, []);
  made.clamped([{ joint: 2, removed: 0.5 }]);
  assert.match(said.at(-1)!, /Knee, left is at its limit: 28.6°/);
});

test("who looks on poses nothing, and what others show is shown", () => {
  const { poser: made, sent, said, history } = poser(false);
  assert.equal(made.turn(2, 0, 1), null);
  assert.equal(made.begin(), false);
  made.resetAll();
  made.mirror();
  assert.deepEqual(sent, []);
  assert.match(said.at(-1)!, /take control to pose/);
  made.observe(withWire(0.7));
  assert.ok(Math.abs(made.angle(2, 0) - 0.7) < 1e-12);
  assert.equal(history.canUndo, null);
  // Control that is given: the next change starts from what is shown.
  made.control(true);
  made.turn(1, 0, 0.1);
  assert.ok(Math.abs(made.angle(2, 0) - 0.7) < 1e-12);
});

const withWire = (flexion: number) => ({ rotation: withRotation(restPose(rig), 2, turnAbout([1, 0, 0], flexion)).rotation.flat() });

test("typed degrees", () => {
  for (const [text, degrees] of [["35", 35], [" -12,5 ", -12.5], ["\u22127°", -7], ["+.5 deg", 0.5]] as const) {
    assert.ok(Math.abs(typedDegrees(text)! * DEGREES - degrees) < 1e-12, text);
  }
  for (const text of ["", "much", "1e9", "12 13", "--3"]) assert.equal(typedDegrees(text), null, text);
});

test("one request is on its way, and of the targets that come meanwhile the newest", async () => {
  const asked: number[] = [], answers: ((found: string) => void)[] = [], found: string[] = [];
  const loop = new IkLoop<number, string>((target) => new Promise((resolve) => { asked.push(target); answers.push(resolve); }), (each) => found.push(each), assert.fail);
  for (const target of [1, 2, 3, 4]) loop.aim(target);
  assert.deepEqual(asked, [1]);
  answers[0]!("one");
  await new Promise((resolve) => setImmediate(resolve));
  assert.deepEqual(asked, [1, 4]);
  const settled = loop.settled();
  answers[1]!("four");
  await settled;
  assert.deepEqual(found, ["one", "four"]);
  loop.aim(5);
  loop.stop();
  answers[2]!("five");
  await new Promise((resolve) => setImmediate(resolve));
  assert.deepEqual(found, ["one", "four"]);
});

test("a pull starts from the present pose, holds the pins, and is one step; Escape takes it back", async () => {
  const { poser: made, sent, history } = poser();
  made.togglePin(1);
  const asked: { targets: IkTarget[]; moveRoot: boolean; apply: boolean }[] = [];
  const drag = new BodyDrag(made, {
    solveIk: (targets, options) => {
      asked.push({ targets, moveRoot: options.moveRoot, apply: options.apply });
      return Promise.resolve({ ...withWire(0.9), residual: [12.5, 0, 0] });
    },
  }, assert.fail);
  assert.ok(drag.begin(2, [0, 0, 450]));
  drag.aim([0, -50, 480]);
  await drag.end();
  assert.equal(asked.length, 1);
  const [{ targets, apply }] = asked as [typeof asked[0] & object];
  assert.ok(apply);
  assert.deepEqual(targets.map((target) => target.segment), [2, 1, 1]);
  assert.deepEqual(targets[0]!.target, at(0, -50, 480));
  assert.deepEqual(targets[1]!.target, at(0, 0, 850));
  assert.deepEqual(sent, [], "the server has shown it already");
  assert.ok(Math.abs(made.angle(2, 0) - 0.9) < 1e-12);
  assert.equal(history.canUndo, "Pull shank, left");
  history.undo();
  assert.ok(samePose(made.state.asked, restPose(rig)));
  drag.begin(2, [0, 0, 450]);
  drag.aim([0, -50, 480]);
  await new Promise((resolve) => setImmediate(resolve));
  drag.cancel();
  assert.ok(samePose(made.state.asked, restPose(rig)));
});

test("a link holds pose, camera and layers, and no token", () => {
  const pose: Pose = { ...withRotation(restPose(rig), 2, turnAbout([1, 0, 0], 0.7)), rootTranslation: [10, -20, 30] };
  const view = { pose, camera: { position: [1, 2, 3], target: [0, 1, 0] }, layers: [{ name: "skin", visible: false, opacity: 0.25 }, { name: "Hüfte", visible: true, opacity: 0.5 }], seeThrough: false };
  const fragment = linkFragment("patient", view);
  assert.match(fragment, /^#model=patient&view=[\w-]+$/);
  assert.ok(!/token/.test(fragment));
  const back = readLink(fragment)!(rig);
  assert.ok(samePose(back.pose!, pose));
  assert.deepEqual({ ...back, pose }, view);
  for (const broken of ["", "#model=patient", "#view=%%%", "#view=bm90IGpzb24", `#view=${btoa('{"v":2}')}`]) assert.equal(readLink(broken), null, broken);
  const lying = { v: 1, t: [0, 0, 0], q: [[99, 1, 0, 0, 0]], l: [["skin", "x"]], c: [[1, 2], [3]] };
  assert.deepEqual(readLink(`#view=${btoa(JSON.stringify(lying))}`)!(rig), { pose: null, camera: null, layers: [], seeThrough: null });
});

test("saved poses come back, and what is no pose is left out", () => {
  const kept = new Map<string, string>();
  const storage = { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, value: string) => void kept.set(key, value) };
  const saved = new SavedPoses("leg", storage);
  assert.equal(saved.freeName(), "Pose 1");
  saved.save({ name: "Pose 1", yaml: "a", picture: "" });
  saved.save({ name: "Sit", yaml: "b", picture: "" });
  saved.save({ name: "Pose 1", yaml: "c", picture: "" });
  assert.deepEqual(saved.list().map(({ name, yaml }) => [name, yaml]), [["Sit", "b"], ["Pose 1", "c"]]);
  assert.deepEqual(new SavedPoses("arm", storage).list(), []);
  saved.remove("Sit");
  assert.equal(saved.freeName(), "Pose 2");
  kept.set("ecorche.poses.leg", '[{"name": 3}, null]');
  assert.deepEqual(saved.list(), []);
  kept.set("ecorche.poses.leg", "{");
  assert.deepEqual(saved.list(), []);
  const full = new SavedPoses("leg", { ...storage, setItem: () => { throw new Error("QuotaExceededError"); } });
  assert.throws(() => full.save({ name: "x", yaml: "", picture: "" }), /no room/);
});

test("words", () => {
  assert.equal(spoken("adduction", -30 / DEGREES), "Abduction 30°");
  assert.equal(spoken("lateral_bending", -5 / DEGREES), "Lateral bending \u22125°");
  assert.equal(degreesText(-0.0001), "0°");
  assert.deepEqual(bodyParts(rig).map(({ label, rows }) => [label, rows]), [["Whole body", [0]], ["Leg, left", [1, 2]]]);
  const labels = apart([10, 12, 14].map((y, i) => ({ text: `${i}`, x: 0, y, left: i === 2, kind: "" })));
  assert.deepEqual(labels.map(({ y }) => y), [10, 36, 14]);
});

test("who poses, in words", () => {
  const state = { connected: true, presence: true, controls: false, vacant: false, reservedSeconds: 0, asking: false, people: [], others: 0 };
  const ann = { connection: 2n, name: "Ann", self: false, controls: true, asks: false, takes: true };
  assert.deepEqual(standing(state, ann), { text: "Ann poses. You look on", action: "ask" });
  assert.equal(standing({ ...state, presence: false }, undefined).action, "take");
  assert.equal(standing({ ...state, vacant: true }, undefined).action, "take");
  assert.equal(standing({ ...state, asking: true }, ann).action, "withdraw");
  assert.equal(standing({ ...state, controls: true }, undefined).action, null);
  assert.deepEqual(standing({ ...state, controls: true, people: [{ ...ann, controls: false, asks: true }] }, undefined), { text: "Ann asks to pose", action: "give" });
});

test("a clip goes on between what the server tells of it", () => {
  const now = { $typeName: "ecorche.v1.ClipState" as const, name: "walk", position: 1, seconds: 4, framesPerSecond: 30, speed: 2, loop: false, playing: true };
  assert.equal(positionNow({ now, told: 1000 }, 2000), 3);
  assert.equal(positionNow({ now, told: 1000 }, 9000), 4);
  assert.equal(positionNow({ now: { ...now, loop: true }, told: 1000 }, 3500), 2);
  assert.equal(positionNow({ now: { ...now, playing: false }, told: 1000 }, 9000), 1);
});

test("a skeleton that is none is refused", () => {
  const second = SKELETON.segments[1]!;
  assert.throws(() => rigOf({ ...SKELETON, segments: [SKELETON.segments[0]!, { ...second, parent: 2 }] }), /before its parent/);
  assert.throws(() => rigOf({ ...SKELETON, segments: [{ ...SKELETON.segments[0]!, joint: { ...second.joint, kind: 9 } }] }), /does not know/);
  const flat = { ...second.joint, sequence: second.joint.sequence.map((a) => ({ ...a, axis: 0 })) };
  assert.throws(() => rigOf({ ...SKELETON, segments: [SKELETON.segments[0]!, { ...second, joint: flat }] }), /three different axes/);
});
