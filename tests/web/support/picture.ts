// SPDX-License-Identifier: Apache-2.0
// Where a point of the body is in the page's picture, and what colours are there. Points come from the test's own client, so that the
// page's decoder, buffers and matrices are held against another way.
import type { Page } from "playwright-core";
import type { BodyFrame } from "../../../clients/web/protocol/src/index.js";

type Three = [number, number, number];
export type Rgb = Three;

/** mm, LPS. */
export const place = ({ vertices, scale, offset }: BodyFrame, vertex: number): Three =>
  offset.map((low, axis) => low + scale * vertices[4 * vertex + axis]) as Three;

/** The vertex of a tissue that is most to the front: seen from there, nothing of the tissue itself hides it. */
export function foremost(frame: BodyFrame, tissue: number): Three {
  const range = frame.layout.ranges.find((each) => each.tissue === tissue)!;
  let best = range.firstVertex;
  for (let vertex = best; vertex < range.firstVertex + range.vertexCount; ++vertex) {
    if (frame.vertices[4 * vertex + 1] < frame.vertices[4 * best + 1]) best = vertex;
  }
  return place(frame, best);
}

/** Pixels of the page, by the camera's own numbers and by hand: metres, y up, then the camera, then the picture. */
export async function project(page: Page, [x, y, z]: Three): Promise<{ x: number; y: number }> {
  const { view, projection, box } = await page.evaluate(() => {
    const { stage } = (window as any).ecorche;
    stage.camera.updateMatrixWorld();
    const { left, top, width, height } = stage.canvas.getBoundingClientRect();
    return { view: stage.camera.matrixWorldInverse.elements, projection: stage.camera.projectionMatrix.elements, box: { left, top, width, height } };
  });
  const times = (matrix: number[], point: number[]) => [0, 1, 2, 3].map((row) => point.reduce((sum, value, i) => sum + matrix[row + 4 * i] * value, 0));
  const clip = times(projection, times(view, [x / 1000, z / 1000, -y / 1000, 1]));
  return { x: box.left + (clip[0] / clip[3] / 2 + 0.5) * box.width, y: box.top + (0.5 - clip[1] / clip[3] / 2) * box.height };
}

/** The picture's mean colour within two pixels of a place; the picture is drawn anew for it. */
export function colorAt(page: Page, at: { x: number; y: number }): Promise<Rgb> {
  return page.evaluate(({ x, y }) => {
    const { stage } = (window as any).ecorche;
    const { left, top, width, height } = stage.canvas.getBoundingClientRect();
    const copy = new OffscreenCanvas(5, 5), context = copy.getContext("2d")!;
    stage.render();
    context.drawImage(stage.canvas, ((x - left) / width) * stage.canvas.width - 2, ((y - top) / height) * stage.canvas.height - 2, 5, 5, 0, 0, 5, 5);
    const { data } = context.getImageData(0, 0, 5, 5);
    return [0, 1, 2].map((channel) => data.filter((_: number, i: number) => i % 4 === channel).reduce((sum: number, value: number) => sum + value, 0) / 25);
  }, at) as Promise<Rgb>;
}

/** How many pixels of the picture are within 40 of a colour. */
export function countColor(page: Page, color: Rgb): Promise<number> {
  return page.evaluate((wanted) => {
    const { stage } = (window as any).ecorche;
    const copy = new OffscreenCanvas(stage.canvas.width, stage.canvas.height), context = copy.getContext("2d")!;
    stage.render();
    context.drawImage(stage.canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    let count = 0;
    for (let i = 0; i < data.length; i += 4) if (wanted.every((value: number, channel: number) => Math.abs(data[i + channel] - value) < 40)) ++count;
    return count;
  }, color);
}

export const apart = (one: Rgb, other: Rgb): number => Math.max(...one.map((value, i) => Math.abs(value - other[i])));
