// SPDX-License-Identifier: Apache-2.0
// Posed volumes in Chromium: saved as NIfTI.
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

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));
