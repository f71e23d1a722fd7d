// SPDX-License-Identifier: Apache-2.0
// An emulated headset in a page of the viewer, what its eyes see, and where things are in its room. The matrices are made here by hand, from
// the words of the docs, so that the viewer's own are held against another way.
import { build } from "esbuild";
import path from "node:path";
import type { Page } from "playwright-core";
import type { Rgb } from "./picture.js";

declare const ROOT: string;
export type Three = [number, number, number];
export type Hand = "left" | "right";

const EYES: Three = [0.3, 1.6, 0.5];
/** To the left of -z, radians. */
const YAW = 0.4;
const DISTANCE = 1.2;

/** Before the page loads: `navigator.xr` becomes that of a headset whose wearer stands at EYES and looks past -z by YAW. */
export async function wearHeadset(page: Page): Promise<void> {
  const { outputFiles } = await build({
    entryPoints: ["iwer"], absWorkingDir: path.join(ROOT, "clients/web"), bundle: true, format: "iife", globalName: "IWER", target: "es2022", write: false,
  });
  // Each script has a scope of its own.
  await page.addInitScript({ content: `${outputFiles[0].text}; globalThis.IWER = IWER;` });
  await page.addInitScript(([eyes, yaw]) => {
    const { XRDevice, metaQuest3 } = (globalThis as any).IWER;
    const device = new XRDevice(metaQuest3, { stereoEnabled: true });
    device.installRuntime({ forceInstall: true });
    device.position.set(...(eyes as number[]));
    device.quaternion.set(0, Math.sin((yaw as number) / 2), 0, Math.cos((yaw as number) / 2));
    (globalThis as any).device = device;
  }, [EYES, YAW] as const);
}

/** Where the body's box is, mm, LPS. */
export interface Box {
  low: Three;
  high: Three;
}

/** Of the body in the room: how it was turned and enlarged since it was placed. */
export interface Turned {
  yaw: number;
  scale: number;
}

/** mm, LPS, to metres in the room: the feet on the floor at the distance before the eyes, the front towards them. */
export function inRoom([x, y, z]: Three, { low, high }: Box, { yaw, scale }: Turned = { yaw: 0, scale: 1 }): Three {
  const right = (scale * (x - (low[0] + high[0]) / 2)) / 1000, up = (scale * (z - low[2])) / 1000, front = (-scale * (y - (low[1] + high[1]) / 2)) / 1000;
  const angle = YAW + yaw, sin = Math.sin(angle), cos = Math.cos(angle);
  return [EYES[0] - DISTANCE * Math.sin(YAW) + cos * right + sin * front, up, EYES[2] - DISTANCE * Math.cos(YAW) - sin * right + cos * front];
}

/** A way in the room as one of the body, mm, LPS. */
export function inBody([x, y, z]: Three, { yaw, scale }: Turned = { yaw: 0, scale: 1 }): Three {
  const angle = YAW + yaw, sin = Math.sin(angle), cos = Math.cos(angle);
  return [(1000 * (cos * x - sin * z)) / scale, (-1000 * (sin * x + cos * z)) / scale, (1000 * y) / scale];
}

export interface Seen {
  /** Within the eye's own part of the picture. */
  inside: boolean;
  color: Rgb;
}

/** What each eye sees at a place of the room: the mean within two pixels, of the picture that was drawn for it. */
export function seenAt(page: Page, place: Three): Promise<Seen[]> {
  return page.evaluate(async ([x, y, z]) => {
    const { stage } = (window as any).ecorche;
    await new Promise<void>((resolve) => { const stop = stage.onAfterDraw(() => { stop(); resolve(); (window as any).eyes = new OffscreenCanvas(stage.canvas.width, stage.canvas.height); (window as any).eyes.getContext("2d").drawImage(stage.canvas, 0, 0); }); });
    const { width, height } = stage.canvas, context = (window as any).eyes.getContext("2d");
    const times = (matrix: number[], point: number[]) => [0, 1, 2, 3].map((row) => point.reduce((sum, value, i) => sum + matrix[row + 4 * i] * value, 0));
    return stage.renderer.xr.getCamera().cameras.map(({ matrixWorldInverse, projectionMatrix, viewport }: any) => {
      const clip = times(projectionMatrix.elements, times(matrixWorldInverse.elements, [x, y, z, 1]));
      const left = viewport.x + (clip[0] / clip[3] / 2 + 0.5) * viewport.z, top = height - (viewport.y + (clip[1] / clip[3] / 2 + 0.5) * viewport.w);
      const inside = clip[3] > 0 && left >= viewport.x && left < viewport.x + viewport.z && top >= 0 && top < height && width > 0;
      const { data } = context.getImageData(left - 2, top - 2, 5, 5);
      return { inside, color: [0, 1, 2].map((channel) => data.filter((_: number, i: number) => i % 4 === channel).reduce((sum: number, value: number) => sum + value, 0) / 25) };
    });
  }, place);
}

/** Both eyes, side by side, as a PNG. */
export async function eyesPng(page: Page): Promise<Buffer> {
  const text = await page.evaluate(async () => {
    const { stage } = (window as any).ecorche;
    return new Promise<string>((resolve) => { const stop = stage.onAfterDraw(() => { stop(); resolve(stage.canvas.toDataURL("image/png")); }); });
  });
  return Buffer.from(text.slice(text.indexOf(",") + 1), "base64");
}

/** So that the controller's grip, or the hand's pinch, is at a place of the room. */
export async function hold(page: Page, hand: Hand, place: Three, kind: "controllers" | "hands" = "controllers"): Promise<void> {
  await page.evaluate(async ([side, [x, y, z], from]) => {
    const { device, ecorche } = window as any;
    const input = device[from as string][side as string];
    const { xr } = ecorche.stage.renderer;
    input.quaternion.set(0, 0, 0, 1);
    // Where it holds hangs at the controller's own place: put there once to see by how much.
    const frame = () => new Promise<Three>((resolve) => xr.getSession().requestAnimationFrame((_: number, now: any) => {
      const at = (space: any, joint: boolean) => {
        const { position } = (joint ? now.getJointPose(space, xr.getReferenceSpace()) : now.getPose(space, xr.getReferenceSpace())).transform;
        return [position.x, position.y, position.z];
      };
      const { inputSource } = input;
      if (from === "controllers") return resolve(at(inputSource.gripSpace, false) as Three);
      const [thumb, finger] = ["thumb-tip", "index-finger-tip"].map((name) => at(inputSource.hand.get(name), true));
      resolve(thumb.map((value, i) => (value + finger[i]) / 2) as Three);
    }));
    await frame();
    const grip = await frame();
    const { position } = input;
    position.set(position.x + x - grip[0], position.y + y - grip[1], position.z + z - grip[2]);
    await frame();
  }, [hand, place, kind] as const);
}

/** So that the controller's ray goes from one place of the room to another. */
export async function point(page: Page, hand: Hand, from: Three, to: Three): Promise<void> {
  await page.evaluate(([side, at, [x, y, z]]) => {
    const { controllers } = (window as any).device;
    // From -z to the direction, about the axis that is square to both.
    const size = Math.hypot(x, y, z), [a, b, w] = [y / size, -x / size, 1 - z / size], length = Math.hypot(a, b, w);
    controllers[side as string].position.set(...(at as Three));
    controllers[side as string].quaternion.set(a / length, b / length, 0, w / length);
  }, [hand, from, to.map((value, i) => value - from[i]) as Three] as const);
}

/** So many pictures of the headset. */
export async function pictures(page: Page, count = 3): Promise<void> {
  await page.evaluate((times) => new Promise<void>((resolve) => {
    let left = times;
    const stop = (window as any).ecorche.stage.onAfterDraw(() => { if (--left <= 0) { stop(); resolve(); } });
  }), count);
}

export async function press(page: Page, hand: Hand, button: string, value: number): Promise<void> {
  await page.evaluate(([side, name, to]) => (window as any).device.controllers[side as string].updateButtonValue(name, to), [hand, button, value] as const);
  await pictures(page);
}
