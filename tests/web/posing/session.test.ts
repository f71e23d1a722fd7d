// SPDX-License-Identifier: Apache-2.0
// One session of two, without a page: what each poser has is what the server shows; control asked for, given and taken; clips paused,
// sought, stepped and recorded.
import assert from "node:assert/strict";
import path from "node:path";
import { after, before, test } from "node:test";
import { Client, Role } from "../../../clients/web/protocol/src/index.js";
import { BodyDrag } from "../../../clients/web/viewer/src/posing/body_drag.js";
import { Clips } from "../../../clients/web/viewer/src/posing/clips.js";
import { move } from "../../../clients/web/viewer/src/posing/forward.js";
import { samePose } from "../../../clients/web/viewer/src/posing/pose.js";
import { Poser } from "../../../clients/web/viewer/src/posing/poser.js";
import { findJoint, rigOf } from "../../../clients/web/viewer/src/posing/rig.js";
import { length, subtract, type Vec3 } from "../../../clients/web/viewer/src/posing/rotation.js";
import { Together } from "../../../clients/web/viewer/src/posing/together.js";
import { History } from "../../../clients/web/viewer/src/state/history.js";
import { scratch } from "../support/page.js";
import { Server, within } from "../support/server.js";

class Person {
  readonly said: string[] = [];
  readonly history = new History();
  readonly together = new Together((text) => this.said.push(text));
  readonly clips = new Clips((text) => this.said.push(text));
  readonly poser = new Poser(this.history, { setPose: (pose) => this.client.setPose(pose) }, (text) => this.said.push(text));
  readonly drag = new BodyDrag(this.poser, { solveIk: (targets, options) => this.client.solveIk(targets, options) }, (text) => this.said.push(text));

  private constructor(readonly client: Client) {}

  static async join(name: string): Promise<Person> {
    const client = await Client.connect(server.url, { person: name, worker: false });
    const person = new Person(client);
    client.on("shown", (pose) => person.poser.observe(pose));
    client.on("control", ({ role }) => person.poser.control(role === Role.CONTROLLER));
    const model = await client.open("", "session_of_two");
    person.poser.open(rigOf(model.skeleton!), model.pose ?? { rotation: [] }, model.role === Role.CONTROLLER);
    person.together.follow(client);
    person.clips.follow(client);
    await client.subscribeMesh({ tissues: ["pelvis"] });
    return person;
  }

  get knee(): number {
    return this.poser.angle(findJoint(this.poser.state.rig!, "knee_left"), 0);
  }

  bend(radians: number): void {
    this.poser.turn(findJoint(this.poser.state.rig!, "knee_left"), 0, radians);
  }
}

let server: Server, ann: Person, bo: Person;

before(async () => {
  const motion = path.join(path.dirname(process.env["ECORCHE_MODEL"]!), "small/motion");
  server = await Server.start(["--clips", motion, "--record-dir", scratch()]);
  ann = await Person.join("Ann");
  bo = await Person.join("Bo");
});
after(async () => {
  ann?.client.close();
  bo?.client.close();
  await server?.stop();
});

/** Until `so` holds; what the server tells comes when it comes. */
async function until(so: () => boolean, what: string): Promise<void> {
  await within(60, (async () => {
    while (!so()) await new Promise((resolve) => setTimeout(resolve, 10));
  })(), what);
}

test("who looks on has the pose that is shown, and a newcomer has it at once", async () => {
  ann.bend(0.7);
  await until(() => Math.abs(bo.knee - 0.7) < 1e-12, "Bo's knee");
  assert.equal(ann.poser.state.controls, true);
  assert.equal(bo.poser.state.controls, false);
  const third = await Person.join("Cy");
  assert.ok(Math.abs(third.knee - 0.7) < 1e-12, "before any frame");
  third.client.close();
  await until(() => bo.together.holder?.name === "Ann", "who poses");
});

test("control is asked for and given, and its new holder goes on from there", async () => {
  await bo.together.take();
  assert.equal(bo.together.store.state.asking, true);
  await until(() => ann.said.includes("Bo asks to pose"), "the asking");
  await ann.together.give(ann.together.store.state.people.find(({ name }) => name === "Bo")!);
  await until(() => bo.poser.state.controls && !ann.poser.state.controls, "the giving");
  assert.equal(bo.together.store.state.asking, false);
  bo.poser.turn(findJoint(bo.poser.state.rig!, "hip_left"), 0, 0.4);
  await until(() => samePose(ann.poser.state.asked, bo.poser.state.asked), "Bo's pose");
  assert.ok(Math.abs(ann.knee - 0.7) < 1e-12, "the knee stayed as Ann had it");
  // A pose of hers is not taken any more, nor her undo.
  ann.history.undo();
  assert.match(ann.said.at(-1)!, /take control to pose/);
});

test("control that is given up is taken", async () => {
  await bo.together.release();
  await until(() => ann.together.store.state.vacant, "that it is free");
  await ann.together.take();
  await until(() => ann.poser.state.controls, "control");
  ann.bend(0.2);
  await until(() => Math.abs(bo.knee - 0.2) < 1e-12, "Bo's knee");
});

test("a pull reaches its target within a millimetre while pins stay, and others see it", async () => {
  ann.poser.resetAll();
  const { rig } = ann.poser.state;
  const wrist = findJoint(rig!, "wrist_left"), foot = findJoint(rig!, "ankle_left");
  ann.poser.togglePin(foot);
  ann.drag.setMoveRoot(true);
  const from = rig!.segments[wrist]!.joint.center, to: Vec3 = [from[0] + 30, from[1] - 80, from[2] + 120];
  const left = await ann.drag.reach(wrist, from, to);
  assert.ok(left! < 1, `${left} mm are left`);
  assert.ok(length(subtract(move(ann.poser.state.motions[wrist]!, from), to)) < 1);
  const ankle = rig!.segments[foot]!.joint.center;
  assert.ok(length(subtract(move(ann.poser.state.motions[foot]!, ankle), ankle)) < 1, "the pinned foot stays");
  await until(() => samePose(bo.poser.state.asked, ann.poser.state.asked), "the pull at Bo's");
  assert.equal(ann.history.canUndo, "Pull hand, left");
  ann.history.undo();
  await until(() => bo.poser.state.asked.rotation.every((q) => q[0] === 1), "the undoing at Bo's");
  ann.poser.togglePin(foot);
});

test("a clip is paused, sought and stepped, and joints go along; a pose of one's own ends it", async () => {
  const { clips } = ann;
  await until(() => clips.store.state.clips.length > 0, "clips");
  await clips.play("bend");
  await until(() => clips.store.state.now?.playing === true, "the clip");
  await clips.pause(true);
  await until(() => clips.store.state.now?.playing === false, "the pause");
  clips.seek(0.5);
  clips.seek(1);
  await until(() => Math.abs(clips.store.state.now!.position - 1) < 0.02, "the seek");
  const { position, framesPerSecond } = clips.store.state.now!;
  await clips.step(1);
  await until(() => Math.abs(clips.store.state.now!.position - position - 1 / framesPerSecond) < 1e-6, "the step");
  await until(() => bo.clips.store.state.now?.name === "bend" && Math.abs(bo.clips.store.state.now.position - clips.store.state.now!.position) < 1e-6, "Bo's clip");
  await until(() => Math.abs(ann.poser.angle(1, 0)) > 0.01 && samePose(ann.poser.state.asked, bo.poser.state.asked), "the clip's pose");
  const trunk = ann.poser.angle(1, 0);
  ann.bend(0.3);
  await until(() => clips.store.state.now === null, "the end of the clip");
  assert.ok(Math.abs(ann.poser.angle(1, 0) - trunk) < 1e-12);
  await until(() => Math.abs(bo.knee - 0.3) < 1e-12 && Math.abs(bo.poser.angle(1, 0) - trunk) < 1e-12, "Ann's pose at Bo's");
});

test("what is recorded is among the clips and plays again", async () => {
  await ann.clips.record("knee_bend");
  for (const radians of [0.1, 0.4, 0.9]) {
    ann.bend(radians);
    await until(() => Math.abs(bo.knee - radians) < 1e-12, "Bo's knee");
  }
  await ann.clips.endRecording();
  assert.ok(ann.clips.store.state.clips.some(({ name }) => name === "knee_bend"), ann.said.at(-1));
  ann.bend(0);
  await ann.clips.play("knee_bend");
  await until(() => Math.abs(bo.knee - 0.9) < 1e-9 && Math.abs(ann.knee - 0.9) < 1e-9, "the recording's last pose");
});
