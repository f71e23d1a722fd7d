// SPDX-License-Identifier: Apache-2.0
// Posed volumes in Chromium: saved as NIfTI, and seen along rays, whose values are known.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import { rigOf } from "../../../clients/web/viewer/src/posing/rig.js";
import { wireOf } from "../../../clients/web/viewer/src/posing/pose.js";
import { presets, type Library } from "../../../clients/web/viewer/src/posing/presets.js";
import library from "../../../io/case/data/poses.yaml";
import { parse } from "yaml";
import { readNifti } from "../support/nifti.js";
import { project } from "../support/picture.js";
import { launch, newPage, openBody, scratch, Site, type Viewed } from "../support/page.js";
import { Server } from "../support/server.js";

const BIN = process.env["ECORCHE_BIN"]!, MODEL = process.env["ECORCHE_MODEL"]!;
const SESSION = "viewer_volume";
let server: Server, site: Site, browser: Browser, viewed: Viewed, client: Client, model: ModelOpened;

before(async () => {
  server = await Server.start();
  site = await Site.start(() => server.httpPort);
  client = await Client.connect(server.url);
  model = await client.open("", SESSION);
  browser = await launch();
  viewed = await newPage(browser, site);
  await openBody(viewed.page, site, `#session=${SESSION}`);
});
after(async () => {
  await browser?.close();
  client?.close();
  site?.stop();
  await server?.stop();
});

test("the saved NIfTI is the one that the program writes of the same pose, voxel for voxel", async () => {
  const { page } = viewed, folder = scratch(), out = path.join(folder, "posed"), names = ["ct", "labels"];
  const sitting = presets(parse(library) as Library, rigOf(model.skeleton!)).find(({ name }) => name === "sitting")!.pose;
  client.setPose(wireOf(sitting));
  execFileSync(BIN, ["pose", MODEL, "-o", out, "--pose", "lib:sitting", "--tissues", "none", "--volumes", names.join(","), "--volume-format", "nii.gz"], { stdio: "pipe" });
  await page.waitForFunction(() => (window as any).ecorche.store.state.poseSequence >= 1n);
  const decoders = [...viewed.files].filter((name) => /save_volume/.test(name));
  assert.deepEqual(decoders, [], "what packs volumes is fetched before it is asked for");
  for (const name of names) {
    const coming = page.waitForEvent("download", { timeout: 120_000 });
    await page.click("#tools button[aria-label^=Save]");
    await page.click(`.menu >> text="Posed volume ${name}"`);
    const download = await coming, file = path.join(folder, `${name}.nii.gz`);
    assert.match(download.suggestedFilename(), new RegExp(`_${name}_pose_1\\.nii\\.gz$`));
    await download.saveAs(file);
    const saved = readNifti(fs.readFileSync(file)), offline = readNifti(fs.readFileSync(path.join(out, `${name}.nii.gz`)));
    assert.deepEqual([saved.size, saved.datatype, saved.components], [offline.size, offline.datatype, offline.components]);
    assert.ok(saved.data.equals(offline.data), `${name}: voxels differ`);
    for (const form of ["sform", "qform"] as const) {
      saved[form].flat().forEach((value, at) => assert.ok(Math.abs(value - offline.sform.flat()[at]!) < 1e-3, `${name}, ${form}: ${saved[form]}, expected ${offline.sform}`));
    }
    // The program's own reader takes it, too, and weighs both forms.
    execFileSync(BIN, ["thin", file, "-o", path.join(folder, `${name}.vtp`), "--threshold", name === "ct" ? "600:" : "1:", "--isotropic", "6"], { stdio: "pipe" });
  }
  await page.waitForFunction(() => document.querySelectorAll(".job").length === 0);
});

test("a save that is cancelled says so, and leaves no file", async () => {
  const { page } = viewed;
  let files = 0;
  page.on("download", () => ++files);
  // At once: a small volume is soon there.
  await page.evaluate(() => {
    const watch = new MutationObserver(() => {
      const button = document.querySelector<HTMLButtonElement>(".job button");
      if (!button) return;
      watch.disconnect();
      button.click();
    });
    watch.observe(document.querySelector("#viewer")!, { childList: true });
  });
  await page.click("#tools button[aria-label^=Save]");
  await page.click('.menu >> text="Posed volume ct"');
  await page.waitForFunction(() => /was not saved: cancelled/.test((window as any).ecorche.said.state.text));
  assert.equal(await page.locator(".job").count(), 0);
  assert.equal(files, 0);
});

const shown = () => page_().waitForFunction(() => (window as any).ecorcheVolume?.view.caster.shown, undefined, { timeout: 120_000 });
const page_ = () => viewed.page;

/** Alpha and colour of the ray through a point of the patient, of a picture in full. */
async function rayThrough(point: readonly [number, number, number]): Promise<number[]> {
  const { x, y } = await project(page_(), [...point] as [number, number, number]);
  return page_().evaluate(async ([left, top]) => {
    const { stage } = (window as any).ecorche, { caster } = (window as any).ecorcheVolume.view, box = stage.canvas.getBoundingClientRect();
    const until = performance.now() + 60_000;
    // Coarse while it moves, then in full.
    do {
      stage.render();
      await new Promise((resolve) => setTimeout(resolve, 60));
    } while (caster.coarse && performance.now() < until);
    return caster.read((left! - box.left) / box.width, 1 - (top! - box.top) / box.height) as number[];
  }, [x, y] as const);
}

test("a ray through a block of one value, and through two layers, has the value that mathematics gives it", async () => {
  await page_().keyboard.press("v");
  await shown();
  // 40 x 40 x 40 voxels of 10 mm at the middle of the body: 100 in front, 200 behind.
  const middle = await page_().evaluate(() => (window as any).ecorche.body.bounds([0]).getCenter(new (window as any).ecorche.stage.controls.target.constructor()).toArray() as number[]);
  const side = 40, step = 10, layers = (front: number, back: number) => page_().evaluate(([center, n, mm, low, high]) => {
    const { view } = (window as any).ecorcheVolume, voxels = new Int16Array((n as number) ** 3);
    voxels.forEach((_, at) => { voxels[at] = (Math.floor(at / (n as number)) % (n as number)) < (n as number) / 2 ? (low as number) : (high as number); });
    const preset = { name: "test", level: 150, width: 200, stops: [{ at: 0, color: 0xff0000, opacity: 0.002 }, { at: 0.5, color: 0x000000, opacity: 0.002 }, { at: 1, color: 0x0000ff, opacity: 0.01 }] };
    view.store.set({ preset, level: 150, width: 200, density: 1, shaded: false });
    const origin = (center as number[]).map((each) => each - ((n as number) / 2 - 0.5) * (mm as number));
    view.show({ type: 4, components: 1, voxels, grid: { size: [n, n, n], origin, spacing: [mm, mm, mm], direction: [1, 0, 0, 0, 1, 0, 0, 0, 1] } }, 0n);
  }, [middle, side, step, front, back] as const);
  const eye = () => page_().evaluate(() => {
    const { stage } = (window as any).ecorche, inverse = stage.patient.matrix.clone().invert();
    return stage.camera.position.clone().applyMatrix4(inverse).toArray() as number[];
  });
  await page_().evaluate(() => (window as any).ecorche.fit("front", true));
  for (const [dx, dz] of [[0, 0], [60, -90], [-130, 40]] as const) {
    const through = [middle[0]! + dx, middle[1]!, middle[2]! + dz] as const, from = await eye();
    // mm between two planes across y, along the ray, both within the block.
    const way = through.map((each, axis) => each - from[axis]!), slope = Math.hypot(...way) / Math.abs(way[1]!), half = (side / 2) * step * slope;
    await layers(50, 50);
    const one = await rayThrough(through);
    assert.ok(Math.abs(one[3]! - (1 - (1 - 0.002) ** (2 * half))) < 0.01, `${one} through ${2 * half} mm, expected alpha ${1 - (1 - 0.002) ** (2 * half)}`);
    assert.ok(Math.abs(one[0]! - one[3]!) < 0.01 && one[2]! < 0.01, `${one} is not red`);
    await layers(50, 250);
    const two = await rayThrough(through), before = 1 - (1 - 0.002) ** half, behind = (1 - before) * (1 - (1 - 0.01) ** half);
    // The border between them is a slope of one voxel.
    assert.ok(Math.abs(two[0]! - before) < 0.02 && Math.abs(two[2]! - behind) < 0.05, `${two}, expected red ${before} and blue ${behind}`);
  }
});

test("a clipping plane cuts rays, and solid surfaces end them", async () => {
  const { page } = viewed, middle = await page.evaluate(() => (window as any).ecorche.body.bounds([0]).getCenter(new (window as any).ecorche.stage.controls.target.constructor()).toArray() as number[]);
  const at = middle as unknown as [number, number, number], whole = await rayThrough(at);
  // What lies before the middle is cut away: the red half.
  await page.keyboard.press("c");
  await page.waitForFunction(() => (window as any).ecorche.body.clipping.length === 1, undefined, { timeout: 60_000 });
  const cut = await rayThrough(at);
  assert.ok(cut[0]! < 0.02 && cut[2]! > whole[2]! + 0.05, `cut ${cut}, whole ${whole}`);
  await page.keyboard.press("c");
  // In front of the skin there is a part of the block, which is larger than the body is deep.
  await page.evaluate(() => {
    const { store } = (window as any).ecorche, skin = store.state.model.tissues.find(({ group }: { group: string }) => group === "skin").row;
    store.set({ isolated: new Set([skin]), seeThrough: false });
    (window as any).ecorcheVolume.view.store.set({ surfaces: true });
  });
  const hidden = await rayThrough(at);
  assert.ok(hidden[3]! < whole[3]! - 0.1, `${hidden} before the skin, ${whole} without it`);
  await page.evaluate(() => {
    (window as any).ecorche.store.set({ isolated: null, seeThrough: true });
    (window as any).ecorcheVolume.view.store.set({ surfaces: false });
  });
});

test("by the colours of bone the phantom's posed bones are seen where they are, and nothing else", async () => {
  const { page } = viewed;
  // Hidden and shown: the server's own volume again.
  await page.evaluate(() => {
    const { view } = (window as any).ecorcheVolume;
    view.store.set({ on: false, factor: null });
    view.store.set({ on: true, shaded: true });
  });
  await shown();
  await page.click("#tab-volume");
  await page.click('[data-transfer="Bone"]');
  await page.evaluate(() => (window as any).ecorche.fit("front", true));
  const middles = await page.evaluate(() => {
    const { body, store } = (window as any).ecorche;
    return ["femur_right", "skull", "pelvis"].map((name) => {
      const tissue = store.state.model.tissues.find((each: { name: string }) => each.name === name);
      if (!tissue) return null;
      const { numbers, low, step } = body.positions, range = body.range(tissue.row), sum = [0, 0, 0];
      for (let vertex = range.firstVertex; vertex < range.firstVertex + range.vertexCount; ++vertex) for (const axis of [0, 1, 2]) sum[axis] += low[axis] + step * numbers[4 * vertex + axis];
      return sum.map((each) => each / range.vertexCount);
    });
  });
  let seen = 0;
  for (const place of middles) {
    if (!place) continue;
    const ray = await rayThrough(place as unknown as [number, number, number]);
    assert.ok(ray[3]! > 0.5, `${ray} where a bone is`);
    ++seen;
  }
  assert.ok(seen >= 2);
  const { max } = await page.evaluate(() => (window as any).ecorche.body.bounds());
  const beside = await rayThrough([(max as { x: number }).x + 60, 0, (max as { z: number }).z]);
  assert.equal(beside[3], 0);
  await page.keyboard.press("v");
  await page.waitForFunction(() => !(window as any).ecorcheVolume.view.caster.shown);
});

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));
