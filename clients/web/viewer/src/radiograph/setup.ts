// SPDX-License-Identifier: Apache-2.0
// Where source and detector stand: the views of runtime/radiograph/views.cpp, about a target on the posed body. LPS, mm.
import { add, dot, rotate, scale, subtract, turnAbout, type Quat, type Vec3 } from "../posing/rotation.js";

export type ViewId = "ap" | "pa" | "lateral_left" | "lateral_right";

export interface View {
  readonly id: ViewId;
  readonly label: string;
  /** Which way the beam goes, and the rows of the picture, in the scanned body. */
  readonly beam: Vec3;
  readonly right: Vec3;
}

export const VIEWS: readonly View[] = [
  { id: "ap", label: "AP", beam: [0, 1, 0], right: [1, 0, 0] },
  { id: "pa", label: "PA", beam: [0, -1, 0], right: [1, 0, 0] },
  { id: "lateral_left", label: "Left lateral", beam: [1, 0, 0], right: [0, 1, 0] },
  { id: "lateral_right", label: "Right lateral", beam: [-1, 0, 0], right: [0, -1, 0] },
];

export interface Detector {
  readonly centre: Vec3;
  /** Unit vectors along a row and a column of pixels. */
  readonly right: Vec3;
  readonly down: Vec3;
  readonly width: number;
  readonly height: number;
}

export interface Setup {
  readonly source: Vec3;
  readonly detector: Detector;
  /** Source to detector. */
  readonly sid: number;
}

export interface Wanted {
  readonly view: ViewId;
  /** How far the source goes round the body's long axis, degrees, from the front to the left. */
  readonly turn: number;
  readonly sid: number;
  readonly width: number;
  readonly height: number;
}

export const viewOf = (id: ViewId): View => VIEWS.find((view) => view.id === id)!;

/** Unit vectors of a view of a body whose root is turned by `root`. */
export function axesOf({ view, turn }: Pick<Wanted, "view" | "turn">, root: Quat): { beam: Vec3; right: Vec3; down: Vec3 } {
  const { beam, right } = viewOf(view), about = turnAbout([0, 0, 1], (turn * Math.PI) / 180);
  const turned = (v: Vec3) => rotate(root, rotate(about, v));
  return { beam: turned(beam), right: turned(right), down: turned([0, 0, -1]) };
}

/** The central ray meets `target`; what hangs on it reaches `behind` mm along the beam, and the detector stands `gap` behind that. */
export function placed(wanted: Wanted, root: Quat, target: Vec3, behind: number, gap = 10): Setup {
  const { beam, right, down } = axesOf(wanted, root);
  const centre = add(target, scale(beam, behind + gap));
  return {
    source: subtract(centre, scale(beam, wanted.sid)), sid: wanted.sid,
    detector: { centre, right, down, width: wanted.width, height: wanted.height },
  };
}

export function cornersOf({ centre, right, down, width, height }: Detector): Vec3[] {
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) => add(centre, add(scale(right, (x! * width) / 2), scale(down, (y! * height) / 2))));
}

/** Which side of the patient is on the picture's left, for the marker: R or L; of a lateral picture the side that is at the detector. */
export function markerOf(setup: Setup, root: Quat): { letter: "R" | "L"; edge: "left" | "right" } {
  const toLeft = rotate(root, [1, 0, 0]), across = dot(setup.detector.right, toLeft);
  if (Math.abs(across) > 0.35) return { letter: "R", edge: across > 0 ? "left" : "right" };
  return { letter: dot(subtract(setup.detector.centre, setup.source), toLeft) > 0 ? "L" : "R", edge: "left" };
}

/** As one says it: `AP`, `PA, 30° oblique`. */
export function projectionName({ view, turn }: Pick<Wanted, "view" | "turn">): string {
  const { label } = viewOf(view);
  return turn === 0 ? label : `${label}, ${Math.abs(Math.round(turn))}° ${turn > 0 ? "to the left" : "to the right"}`;
}
