// SPDX-License-Identifier: Apache-2.0
// A pose as a small drawing of the figure alone: limbs as strokes, the head as a disc. For poses that were never in the picture.
import { constrain } from "./angles.js";
import { forward, move } from "./forward.js";
import type { Pose } from "./pose.js";
import type { Rig } from "./rig.js";
import { add, scale, subtract, type Vec3 } from "./rotation.js";

interface Stroke {
  readonly from: Vec3;
  readonly to: Vec3;
  /** mm. */
  readonly width: number;
}

// How thick what a segment carries is, mm, by its name; the first that fits.
const WIDTHS: readonly (readonly [RegExp, number])[] = [
  [/thigh/, 130], [/shank/, 90], [/upper_arm/, 80], [/forearm/, 65], [/hand|foot|toe/, 60], [/pelvis|lumbar|thorax/, 190], [/neck/, 100], [/girdle/, 90],
];
const widthOf = (name: string): number => WIDTHS.find(([pattern]) => pattern.test(name))?.[1] ?? 50;

/** From each joint to the joints that its segment carries; ends go on by a hand's length. */
export function strokes(rig: Rig, pose: Pose): readonly Stroke[] {
  const motions = forward(rig, constrain(rig, pose).pose);
  return rig.segments.flatMap((segment, row): Stroke[] => {
    const { center } = segment.joint;
    const at = (rest: Vec3) => move(motions[row]!, rest);
    const width = widthOf(segment.name);
    const children = rig.segments.filter((s) => s.parent === row);
    if (children.length > 0) return children.map((child) => ({ from: at(center), to: at(child.joint.center), width }));
    if (segment.parent < 0) return [];
    const above = rig.segments[segment.parent]!.joint.center;
    const way = subtract(center, above), size = Math.hypot(...way) || 1;
    // The head goes up from its joint, and is drawn round.
    const head = /head|skull/.test(segment.name);
    return [{ from: at(head ? add(center, [0, 0, 90]) : center), to: at(head ? add(center, [0, 0, 91]) : add(center, scale(way, 90 / size))), width: head ? 170 : width }];
  });
}

/** Seen a little from the patient's left and from above, so that sitting differs from standing. */
const VIEW: { right: Vec3; up: Vec3; towards: Vec3 } = { right: [0.77, 0.64, 0], up: [-0.16, 0.19, 0.97], towards: [0.62, -0.75, 0.25] };

const project = (v: Vec3): [number, number, number] => [
  v[0] * VIEW.right[0] + v[1] * VIEW.right[1] + v[2] * VIEW.right[2],
  v[0] * VIEW.up[0] + v[1] * VIEW.up[1] + v[2] * VIEW.up[2],
  v[0] * VIEW.towards[0] + v[1] * VIEW.towards[1] + v[2] * VIEW.towards[2],
];

/** Fills the canvas; `ink` and `shade` are colours of what is near and far. */
export function drawFigure(canvas: HTMLCanvasElement, rig: Rig, pose: Pose, ink: string, shade: string): void {
  const context = canvas.getContext("2d")!;
  const flat = strokes(rig, pose).map(({ from, to, width }) => ({ from: project(from), to: project(to), width }));
  const points = flat.flatMap(({ from, to, width }) => [[from[0] - width / 2, from[1] - width / 2], [from[0] + width / 2, from[1] + width / 2],
    [to[0] - width / 2, to[1] - width / 2], [to[0] + width / 2, to[1] + width / 2]]);
  const low = [0, 1].map((i) => Math.min(...points.map((p) => p[i]!))), high = [0, 1].map((i) => Math.max(...points.map((p) => p[i]!)));
  const size = 0.88 * Math.min(canvas.width / (high[0]! - low[0]!), canvas.height / (high[1]! - low[1]!));
  const place = (v: readonly number[]): [number, number] => [
    canvas.width / 2 + (v[0]! - (low[0]! + high[0]!) / 2) * size, canvas.height / 2 - (v[1]! - (low[1]! + high[1]!) / 2) * size,
  ];
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.lineCap = "round";
  const order = [...flat].sort((a, b) => a.from[2] + a.to[2] - b.from[2] - b.to[2]);
  order.forEach((stroke, i) => {
    context.strokeStyle = i < order.length / 2 ? shade : ink;
    context.lineWidth = Math.max(1.5, stroke.width * size);
    context.beginPath();
    context.moveTo(...place(stroke.from));
    context.lineTo(...place(stroke.to));
    context.stroke();
  });
}
