// SPDX-License-Identifier: Apache-2.0
// Slices in Chromium: loaded when asked for, their pixels, the linked cross-hair, windows, measures by clicks, and the body cut open.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import type { Browser } from "playwright-core";
import { Client, type BodyFrame, type ModelOpened } from "../../../clients/web/protocol/src/index.js";
import type { PlaneGeometry } from "../../../clients/web/viewer/src/slices/plane.js";
import { orientationOf, pointAt } from "../../../clients/web/viewer/src/slices/plane.js";
import { CT_PRESETS, greyOf, type Window } from "../../../clients/web/viewer/src/slices/window.js";
import { launch, newPage, openBody, Site, type Viewed } from "../support/page.js";
import { apart, colorAt, foremost, project } from "../support/picture.js";
import { Server } from "../support/server.js";

type Three = readonly [number, number, number];
const SESSION = "viewer_slices";
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

const part = <T>(read: string) => viewed.page.evaluate(`(${read})(window.ecorcheSlices)`) as Promise<T>;
const state = <T>(read: string) => part<T>(`({ slices }) => (${read})(slices.store.state)`);

/** Waits until every plane shows the cross-hair's place. */
const current = () => viewed.page.waitForFunction(() => {
  const { slices, board } = (window as any).ecorcheSlices ?? {};
  return board && [...board.views.values()].every((view: any) => view.plane && view.plane.origin[view.orientation.normal] === slices.store.state.cross[view.orientation.normal]);
}, undefined, { timeout: 90_000, polling: 200 });

/** Where a point is on a plane, pixels of the page. */
const onPage = (id: string, point: Three) => viewed.page.evaluate(([plane, at]) => {
  const view = (window as any).ecorcheSlices.board.views.get(plane), box = view.canvas.getBoundingClientRect(), { x, y } = view.placeOf(at);
  return { x: box.left + x, y: box.top + y };
}, [id, point] as const);

/** What the page draws there. */
const drawn = (id: string, points: readonly Three[]) => viewed.page.evaluate(([plane, all]) => {
  const view = (window as any).ecorcheSlices.board.views.get(plane), ratio = view.canvas.width / view.canvas.clientWidth;
  view.draw();
  return all.map((point) => {
    const { x, y } = view.placeOf(point);
    if (x < 1 || y < 1 || x > view.canvas.clientWidth - 1 || y > view.canvas.clientHeight - 1) return null;
    return [...view.canvas.getContext("2d").getImageData(Math.floor(x * ratio), Math.floor(y * ratio), 1, 1).data] as number[];
  });
}, [id, points] as const);

test("the slices come when they are asked for, and not before", async () => {
  const { page, files } = viewed;
  const before = [...files].filter((name) => /\/part-/.test(name));
  assert.deepEqual(before, []);
  await page.keyboard.press("x");
  await current();
  assert.equal([...files].filter((name) => /\/part-/.test(name)).length, 1);
  assert.equal(await page.locator(".plane canvas:visible").count(), 3);
  assert.deepEqual(await page.locator(".plane[data-plane=axial] .letter").allTextContents(), ["R", "L", "A", "P"]);
});

test("a drawn pixel is the posed volume's voxel under the window of a preset", async () => {
  const { page } = viewed;
  const { x, y, z } = model.skeleton!.segments.find(({ name }) => name === "thorax")!.joint!.center!;
  await part(`({ slices }) => { slices.store.set({ overlay: 0, smooth: false }); slices.moveTo([${x}, ${y}, ${z}]); }`);
  await current();
  for (const preset of CT_PRESETS) {
    await page.click(`[data-preset="${preset.name}"]`);
    assert.deepEqual(await state<Window>("(s) => s.window"), { width: preset.width, level: preset.level });
  }
  await page.click("[data-preset='Bone']");
  const bone = CT_PRESETS[1]!, { background } = model.volumes.find(({ name }) => name === "ct")!;
  const probed = async (points: readonly Three[]) => {
    const values: number[] = [];
    for (let at = 0; at < points.length; at += 5000) values.push(...(await client.probe(points.slice(at, at + 5000).flat(), { volumes: ["ct"] })).values!);
    return values;
  };
  for (const id of ["axial", "coronal", "sagittal"]) {
    // So near that no rounding of pixels leads to a neighbour.
    const plane = await part<PlaneGeometry>(`({ board }) => { const view = board.views.get("${id}"); view.fit(); view.zoomBy(view.mmPerPixel); return view.plane; }`);
    const points: Three[] = [];
    for (let row = 1; row < plane.height; row += 3) for (let column = 1; column < plane.width; column += 2) points.push(pointAt(plane, column, row));
    // What the server says of the same places by another way.
    const rest = await probed(points);
    const pixels = await drawn(id, points);
    const { cross } = await state<{ cross: Three }>("(s) => ({ cross: s.cross })");
    let inBody = 0, compared = 0, off = 0;
    points.forEach((point, i) => {
      if (!pixels[i]) return;
      const [red, green, blue] = pixels[i]!;
      // Lines, letters and the scale are drawn over it: those pixels have a colour, or are not of the volume.
      if (point.some((value, axis) => axis !== orientationOf(plane.id).normal && Math.abs(value - cross[axis]!) < 13) || red !== green || green !== blue) return;
      ++compared;
      if (rest[i] !== background) ++inBody;
      if (Math.abs(red! - greyOf(Math.round(rest[i]!), bone)) > 1) ++off;
    });
    // A ray of the probe and one of the plane may choose differently at the very border of the body.
    assert.ok(compared > 60 && inBody > 15 && off <= 0.03 * inBody + 3, `${id}: ${off} of ${inBody} pixels in the body differ (${compared} compared)`);
  }
  await part("({ board }) => board.fit()");
});

test("a click moves the cross-hair in all planes, wheel and arrows step by a slice", async () => {
  const { page } = viewed, step = 6;
  const cross = () => state<Three>("(s) => s.cross");
  const target: Three = [(await cross())[0] + 10 * step, (await cross())[1], (await cross())[2] + 20 * step];
  const at = await onPage("coronal", target);
  await page.mouse.click(at.x, at.y);
  assert.ok(apart([...await cross()] as [number, number, number], [...target] as [number, number, number]) <= step, `${await cross()}, expected ${target}`);
  await current();
  const before = await cross();
  await page.mouse.wheel(0, -120);
  await page.waitForFunction((y) => (window as any).ecorcheSlices.slices.store.state.cross[1] === y, before[1] + step);
  await page.focus(".plane[data-plane=axial] canvas");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.press("ArrowDown");
  assert.equal((await cross())[2], before[2] + step);
  await page.keyboard.press("Shift+ArrowRight");
  assert.equal((await cross())[0], before[0] + step);
  await current();
});

test("two clicks measure the true distance, posed and scanned, and it is listed, copied and removed", async () => {
  const { page } = viewed;
  const { x, y, z } = model.skeleton!.segments.find(({ name }) => name === "thorax")!.joint!.center!;
  await part(`({ slices, board }) => { slices.moveTo([${x}, ${y}, ${z}]); board.fit(); }`);
  await current();
  const plane = await part<PlaneGeometry>("({ board }) => board.views.get('coronal').plane");
  const level = (await state<Three>("(s) => s.cross"))[2];
  const ends: Three[] = [[-90, plane.origin[1], level], [90, plane.origin[1], level]];
  await page.focus("#canvas");
  await page.keyboard.press("l");
  for (const end of ends) {
    const at = await onPage("coronal", end);
    await page.mouse.click(at.x, at.y);
  }
  await page.waitForFunction(() => (window as any).ecorcheSlices.measures.store.state.list.length === 1);
  const mm = await part<number>("({ board }) => board.views.get('coronal').mmPerPixel");
  const row = page.locator(".measures tbody tr");
  const [posed, scanned] = (await row.locator("td").allTextContents()).map(Number.parseFloat);
  assert.ok(Math.abs(posed! - 180) <= 2 * mm && Math.abs(scanned! - posed!) < 0.11, `${posed} and ${scanned} mm, expected 180 within ${2 * mm}`);
  assert.ok((await row.textContent())!.includes("Distance 1"));
  await page.click(".measures button[aria-label='Remove distance 1']");
  assert.equal(await row.count(), 0);
  await page.keyboard.press("Escape");
  await part("({ slices }) => slices.store.set({ tool: 'cross', open: false })");
});

test("two clicks on the body measure between the points of its surface that were clicked", async () => {
  const { page } = viewed, stream = await client.subscribeMesh();
  const frame = stream.latest ?? await new Promise<BodyFrame>((resolve) => stream.on("frame", resolve));
  const rows = ["femur_left", "femur_right"].map((name) => model.tissues.findIndex((tissue) => tissue.name === name));
  // Nothing else stands before them; the foremost vertex of each is seen from the front. (Of the skull that is a spike.)
  await page.evaluate((only) => (window as any).ecorche.layers.isolate(only), rows);
  await page.evaluate(() => (window as any).ecorche.fit("front", true));
  await page.keyboard.press("l");
  const ends = rows.map((row) => foremost(frame, row));
  for (const end of ends) {
    const { x, y } = await project(page, end);
    await page.mouse.click(x, y);
  }
  await page.waitForFunction(() => (window as any).ecorcheSlices.measures.store.state.list.length === 1);
  const points = await part<{ posed: Three; rest: Three | null }[]>("({ measures }) => measures.store.state.list[0].points");
  // A pixel is some mm wide, and the surface slopes away from the vertex by less than it.
  const mm = await page.evaluate(() => (window as any).ecorche.stage.camera.position.length() * 2000 * Math.tan(Math.PI / 12) / (window as any).ecorche.stage.canvas.clientHeight);
  points.forEach(({ posed }, at) => assert.ok(Math.hypot(...posed.map((value, axis) => value - ends[at]![axis]!)) < 3 * mm + 2, `${posed} was clicked, ${ends[at]} aimed at`));
  const expected = Math.hypot(...ends[0]!.map((value, axis) => value - ends[1]![axis]!));
  const shown = Number.parseFloat((await page.locator(".measures tbody tr td").first().textContent())!);
  assert.ok(Math.abs(shown - expected) < 3 * mm + 2, `${shown} mm, expected ${expected}`);
  await page.click(".measures button[aria-label='Remove distance 1']");
  await page.keyboard.press("Escape");
  await part("({ slices }) => slices.store.set({ tool: 'cross', open: false })");
  await page.evaluate((only) => (window as any).ecorche.layers.isolate(only), rows);
  await client.closeMesh(stream);
});

test("the clipping plane opens the body and closes the cut with lids", async () => {
  const { page } = viewed;
  const femur = model.tissues.findIndex(({ name }) => name === "femur_right");
  await page.evaluate((row) => (window as any).ecorche.layers.isolate([row]), femur);
  // Within the shaft: the mean of its surface at half of its height.
  const middle = await page.evaluate((row) => {
    const { body } = (window as any).ecorche, { min, max } = body.bounds([row]), { numbers, low, step } = body.positions, range = body.range(row);
    const height = (min.z + max.z) / 2, sum = [0, 0, 0];
    let count = 0;
    for (let vertex = range.firstVertex; vertex < range.firstVertex + range.vertexCount; ++vertex) {
      const place = [0, 1, 2].map((axis) => low[axis] + step * numbers[4 * vertex + axis]);
      if (Math.abs(place[2]! - height) > 15) continue;
      ++count;
      for (const axis of [0, 1, 2]) sum[axis]! += place[axis]!;
    }
    return sum.map((each) => each / count);
  }, femur) as unknown as Three;
  // Across the shaft, seen from above: there is no lid before the cut, and the tissue's flat colour after it. The plane's handle stands
  // aside, not before the pixel that is read.
  const beside = [middle[0] + 150, middle[1], middle[2]];
  await page.evaluate(() => (window as any).ecorche.fit("top", true));
  const at = await project(page, [...middle] as [number, number, number]);
  await part(`({ clipping }) => { clipping.toggle(); clipping.store.set({ clip: { ...clipping.store.state.clip, plane: "axial", tilt: 0, turn: 0, at: ${JSON.stringify(beside)}, flipped: true } }); }`);
  const lid = await colorAt(page, at);
  assert.ok(apart(lid, [0xe9, 0xdf, 0xc6]) < 16, `${lid} where the lid of a bone should be`);
  await part("({ clipping }) => clipping.store.set({ clip: { ...clipping.store.state.clip, at: [0, 0, -5000] } })");
  const gone = await colorAt(page, at);
  assert.ok(apart(gone, lid) > 12, "nothing is cut away");
  await part("({ clipping }) => clipping.toggle()");
});

test("nothing went wrong in the page", () => assert.deepEqual(viewed.faults, []));
