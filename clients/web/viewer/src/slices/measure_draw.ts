// SPDX-License-Identifier: Apache-2.0
// Measures in the pictures: on the planes that hold their points, and over the body.
import * as THREE from "three";
import { apart, Overlay, type Label } from "../posing/overlay.js";
import { Projector, three } from "../posing/projector.js";
import type { Vec3 } from "../posing/rotation.js";
import type { Stage } from "../scene/stage.js";
import { shortText } from "./measure.js";
import type { Measures } from "./measures.js";
import type { Draw } from "./plane_view.js";

export const MEASURE_COLOR = 0x35c9ff;
const COLOR = "#35c9ff";

interface Shape {
  readonly points: readonly Vec3[];
  readonly text: string;
}

/** What there is to draw: whole measures with their words, and the one under way up to the pointer. */
export function shapesOf({ store }: Measures): readonly Shape[] {
  const { list, draft, tip } = store.state;
  const made = list.map((measure) => ({ points: measure.points.map(({ posed }) => posed), text: shortText(measure) }));
  if (!draft) return made;
  return [...made, { points: [...draft.points.map(({ posed }) => posed), ...(tip ? [tip] : [])], text: "" }];
}

/** On a plane, where all points lie in it: half of a slice to each side. */
export function drawOnPlane(measures: Measures, halfSlice: (axis: number) => number, axisOf: (id: string) => number): Draw {
  return (context, place, plane) => {
    const half = halfSlice(axisOf(plane.id)) + 1e-6;
    const words: Label[] = [];
    for (const { points, text } of shapesOf(measures)) {
      const at = points.map(place);
      if (at.some(({ off }) => Math.abs(off) > half)) continue;
      context.strokeStyle = context.fillStyle = COLOR;
      context.lineWidth = 1.5;
      context.shadowColor = "#000";
      context.shadowBlur = 3;
      context.beginPath();
      at.forEach(({ x, y }, i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
      context.stroke();
      for (const { x, y } of at) {
        context.beginPath();
        context.arc(x, y, 3, 0, 2 * Math.PI);
        context.fill();
      }
      const { x, y } = at.length === 3 ? at[1]! : { x: (at[0]!.x + at.at(-1)!.x) / 2, y: (at[0]!.y + at.at(-1)!.y) / 2 };
      if (text) words.push({ text, x: x + 9, y: y - 12, left: false, kind: "measure" });
    }
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.shadowColor = "#000";
    for (const { text, x, y } of apart(words)) {
      context.shadowBlur = 3;
      context.fillStyle = COLOR;
      context.fillText(text, x, y);
    }
    context.shadowBlur = 0;
  };
}

export class MeasureScene {
  readonly #overlay = new Overlay();
  readonly #projector: Projector;
  readonly #lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: MEASURE_COLOR, depthTest: false, transparent: true, toneMapped: false }));
  readonly #dots = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ color: MEASURE_COLOR, size: 7, sizeAttenuation: false, depthTest: false, transparent: true, toneMapped: false }));

  constructor(private readonly stage: Stage, private readonly measures: Measures) {
    this.#projector = new Projector(stage);
    for (const each of [this.#lines, this.#dots]) {
      each.frustumCulled = false;
      each.renderOrder = 96;
      stage.patient.add(each);
    }
    stage.canvas.parentElement!.append(this.#overlay.root);
    measures.store.watch((state) => state, () => this.#update(), true);
    stage.onBeforeDraw(() => this.#label());
  }

  #update(): void {
    const shapes = shapesOf(this.measures);
    const pairs = shapes.flatMap(({ points }) => points.slice(1).flatMap((point, i) => [points[i]!, point]));
    // A geometry keeps the size that it was made with.
    const fill = (object: THREE.LineSegments | THREE.Points, points: readonly Vec3[]) => {
      object.geometry.dispose();
      object.geometry = new THREE.BufferGeometry().setFromPoints(points.map(three));
      object.visible = points.length > 0;
    };
    fill(this.#lines, pairs);
    fill(this.#dots, shapes.flatMap(({ points }) => points));
    this.stage.invalidate();
  }

  #label(): void {
    const labels = shapesOf(this.measures).filter(({ text }) => text).flatMap(({ points, text }): Label[] => {
      const middle = points.length === 3 ? points[1]! : [0, 1, 2].map((axis) => (points[0]![axis]! + points[1]![axis]!) / 2) as unknown as Vec3;
      const at = this.#projector.toScreen(middle);
      return Math.abs(at.depth) > 1 ? [] : [{ text, x: at.x, y: at.y, left: false, kind: "measure" }];
    });
    this.#overlay.show(labels);
  }
}
