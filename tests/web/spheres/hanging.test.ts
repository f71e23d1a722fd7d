// SPDX-License-Identifier: Apache-2.0
// Balls hung by hand: what the session's volume then shows is what `ecorche refill` makes of the file that the page writes.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import { create } from "@bufbuild/protobuf";
import { parse } from "yaml";
import { Client, Deformer, Role, ServerError, SubscribeSchema, VolumeDecoder, type ModelOpened, type VolumeFrame, type VolumeImage } from "../../../clients/web/protocol/src/index.js";
import { inflate } from "../../../clients/web/protocol/src/volume/zstd.js";
import { forward } from "../../../clients/web/viewer/src/posing/forward.js";
import { wireOf, type Pose } from "../../../clients/web/viewer/src/posing/pose.js";
import { presets, type Library } from "../../../clients/web/viewer/src/posing/presets.js";
import { rigOf, type Rig } from "../../../clients/web/viewer/src/posing/rig.js";
import { aboutJoints, Hanging } from "../../../clients/web/viewer/src/spheres/hanging.js";
import { writeVtp } from "../../../clients/web/viewer/src/spheres/vtp.js";
import { History } from "../../../clients/web/viewer/src/state/history.js";
import library from "../../../io/case/data/poses.yaml";
import { readNrrd } from "../support/nrrd.js";
import { scratch } from "../support/page.js";
import { Server, within } from "../support/server.js";

const BIN = process.env["ECORCHE_BIN"]!, CASE = process.env["ECORCHE_CASE"]!;
const folder = scratch(), MODEL = path.join(folder, "balls.hdf");
let server: Server, client: Client, model: ModelOpened, rig: Rig, sitting: Pose;
const came: { frame: VolumeFrame; payload: Uint8Array<ArrayBuffer> }[] = [];

before(async () => {
  // The fixtures' models hold no balls.
  execFileSync(BIN, ["preprocess", CASE, "-o", MODEL, "--max-tets", "20000", "--spheres", "0.48"], { stdio: "pipe" });
  server = await Server.start([], { model: MODEL });
  client = await Client.connect(server.url);
  model = await client.open("", "balls");
  rig = rigOf(model.skeleton!);
  sitting = presets(parse(library) as Library, rig).find(({ name }) => name === "sitting")!.pose;
  client.on("volume", ({ frame, payload }) => came.push({ frame, payload: payload as Uint8Array<ArrayBuffer> }));
});
after(async () => {
  client?.close();
  await server?.stop();
});

/** The next volume by balls that comes, of the sitting pose. */
async function next(from: number): Promise<VolumeImage> {
  return within(120, (async () => {
    for (;;) {
      const found = came.slice(from).find(({ frame }) => frame.poseSequence === 1n);
      if (found) {
        assert.equal(found.frame.status?.code ?? 0, 0, found.frame.status?.message);
        return new VolumeDecoder(inflate).decode(found.frame, found.payload);
      }
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
  })(), "a volume by balls");
}

/** What the program makes of the balls as they hang here. */
async function refilled(name: string, segment: Int32Array, joints: Float64Array | null): Promise<ReturnType<typeof readNrrd>> {
  const spheres = await client.spheres("ct"), file = path.join(folder, `${name}.vtp`), out = path.join(folder, `${name}.nrrd`);
  const vtp = writeVtp({ ...spheres, segment: segment as Int32Array<ArrayBuffer> }, model.skeleton!.segments.map((each) => each.name), joints);
  fs.writeFileSync(file, Buffer.from(await vtp.arrayBuffer()));
  execFileSync(BIN, ["refill", file, path.join(CASE, "volumes/ct.nrrd"), "-o", out, "--rig", MODEL, "--pose", "lib:sitting", "--background", String(model.volumes[0]!.background)], { stdio: "pipe" });
  return readNrrd(out);
}

function differences(is: VolumeImage, expected: ReturnType<typeof readNrrd>): number {
  assert.deepEqual([...is.grid.size], expected.sizes);
  is.grid.origin.forEach((value, axis) => assert.ok(Math.abs(value - expected.origin[axis]!) < 1e-6));
  let differ = 0;
  for (let at = 0; at < is.voxels.length; ++at) differ += Number(is.voxels[at] !== expected.values[at]);
  return differ;
}

test("balls hung on another segment change the posed volume as the program with the page's file does; undone, it is as before", async () => {
  await client.ask({ case: "subscribe", value: create(SubscribeSchema, { what: { case: "volume", value: { volume: "ct", compressed: true, deformer: Deformer.SPHERES } } }) }, "subscribed");
  client.setPose(wireOf(sitting));
  const spheres = await client.spheres("ct"), own = await next(0);
  assert.equal(spheres.byHand, false);
  assert.ok(spheres.distance.length > 500 && spheres.parent);
  assert.equal(differences(own, await refilled("own", spheres.segment, null)), 0);

  const row = (name: string) => model.skeleton!.segments.findIndex((each) => each.name === name), history = new History();
  const hanging = new Hanging(history, (volume, segment, joints) => client.hangSpheres(volume, segment, joints), (text) => assert.fail(text));
  hanging.open("ct", spheres);
  const shank = Array.from(spheres.segment.keys()).filter((ball) => spheres.segment[ball] === row("shank_left"));
  hanging.pick(shank.slice(0, Math.ceil(shank.length / 2)), "replace");
  let from = came.length;
  hanging.assign(row("thigh_left"), "thigh_left");
  await hanging.sent();
  const { segment } = hanging.store.state, hung = await next(from);
  assert.ok((await client.spheres("ct")).byHand);
  assert.deepEqual((await client.spheres("ct")).segment, segment);
  assert.equal(differences(hung, await refilled("hung", segment, null)), 0);
  assert.ok(hung.voxels.length !== own.voxels.length || hung.voxels.some((value, at) => value !== own.voxels[at]), "nothing changed");

  from = came.length;
  history.undo();
  await hanging.sent();
  assert.deepEqual((await next(from)).voxels, own.voxels);
  assert.equal((await client.spheres("ct")).byHand, false);
});

test("a joint that was moved turns the balls about another place, in the session and by the file", async () => {
  const spheres = await client.spheres("ct"), joints = spheres.joints.slice(), knee = model.skeleton!.segments.findIndex((each) => each.name === "shank_left");
  joints[3 * knee + 1]! += 25;
  joints[3 * knee + 2]! -= 40;
  const from = came.length;
  await client.hangSpheres("ct", null, joints);
  const moved = await next(from), expected = await refilled("moved", spheres.segment, joints);
  // Motions are put together in another order: a centre may be rounded to the next sixteenth of a voxel.
  const different = differences(moved, expected);
  assert.ok(different <= 1e-4 * moved.voxels.length, `${different} of ${moved.voxels.length} voxels differ`);
  const unmoved = await refilled("unmoved", spheres.segment, null);
  assert.ok(unmoved.sizes.some((size, axis) => size !== expected.sizes[axis]) || unmoved.values.some((value, at) => value !== expected.values[at]), "the joint moved nothing");

  // The page's own preview: the motions of a rig whose joint is there.
  const segments = rig.segments.map((each, row) => (row === knee ? { ...each, joint: { ...each.joint, center: [joints[3 * row]!, joints[3 * row + 1]!, joints[3 * row + 2]!] as const } } : each));
  const whole = forward({ ...rig, segments }, sitting), previewed = aboutJoints(rig, joints, forward(rig, sitting));
  previewed.forEach(({ q, t }, row) => {
    t.forEach((value, axis) => assert.ok(Math.abs(value - whole[row]!.t[axis]!) < 1e-6, `${rig.segments[row]!.name}: ${t}, expected ${whole[row]!.t}`));
    assert.ok(Math.abs(Math.abs(q.reduce((sum, value, at) => sum + value * whole[row]!.q[at]!, 0)) - 1) < 1e-9);
  });
});

test("what is no hanging is refused, and by whom it may not be, and nothing changes", async () => {
  const before = await client.spheres("ct"), count = before.segment.length, segments = model.skeleton!.segments.length;
  const refused = async (run: Promise<unknown>, words: RegExp) => assert.rejects(run, (error) => error instanceof ServerError && words.test(error.message), String(words));
  await refused(client.hangSpheres("ct", new Int32Array(count - 1), null), /'segment' is no i32 array/);
  await refused(client.hangSpheres("ct", new Int32Array(count).fill(segments), null), /hangs on no segment/);
  await refused(client.hangSpheres("ct", new Int32Array(count).fill(-1), null), /hangs on no segment/);
  await refused(client.hangSpheres("ct", null, new Float64Array(3)), /'joints' is no f64 array/);
  await refused(client.hangSpheres("ct", null, new Float64Array(3 * segments).fill(NaN)), /beyond 1e6 mm/);
  await refused(client.spheres("nothing"), /no volume 'nothing'/);
  const other = await Client.connect(server.url);
  try {
    await other.open("", "balls");
    assert.equal(other.control.role, Role.OBSERVER);
    await refused(other.hangSpheres("ct", null, null), /does not control/);
    assert.deepEqual((await other.spheres("ct")).joints, before.joints);
  } finally {
    other.close();
  }
  assert.deepEqual(await client.spheres("ct"), before);
});
