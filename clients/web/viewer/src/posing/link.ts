// SPDX-License-Identifier: Apache-2.0
// A link that brings back what one sees: pose, camera and layers in the fragment, which browsers send to no server. Never the token.

import type { Pose } from "./pose.js";
import { poseOf, type WirePose } from "./pose.js";
import type { Rig } from "./rig.js";
import type { Quat } from "./rotation.js";

export interface LinkedCamera {
  readonly position: readonly number[];
  readonly target: readonly number[];
}

/** Of a tissue by name, so that the link holds where rows are others. */
export interface LinkedLayer {
  readonly name: string;
  readonly visible: boolean;
  readonly opacity: number;
}

export interface LinkedView {
  readonly pose: Pose | null;
  readonly camera: LinkedCamera | null;
  /** Only those that are not as they are at first; null: not said. */
  readonly layers: readonly LinkedLayer[] | null;
  readonly seeThrough: boolean | null;
}

const KEY = "view";
const VERSION = 1;

// Nine digits: a millionth of a degree, and a pose of twenty joints in a kilobyte.
const short = (x: number): number => Number(x.toPrecision(9));

interface Packed {
  v: number;
  /** Root translation; then row and quaternion of each joint that is turned; then row and translation. */
  t?: number[];
  q?: number[][];
  s?: number[][];
  c?: number[][];
  l?: (string | number)[][];
  g?: boolean;
}

const base64 = (text: string): string =>
  btoa(String.fromCharCode(...new TextEncoder().encode(text))).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
const unbase64 = (text: string): string =>
  new TextDecoder("utf-8", { fatal: true }).decode(Uint8Array.from(atob(text.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0)));

/** The fragment of an address that opens this model with this view. */
export function linkFragment(model: string, view: LinkedView): string {
  const packed: Packed = { v: VERSION };
  if (view.pose) {
    packed.t = view.pose.rootTranslation.map(short);
    packed.q = view.pose.rotation.flatMap((q, row) => (q[0] === 1 ? [] : [[row, ...q.map(short)]]));
    packed.s = view.pose.translation.flatMap((t, row) => (row > 0 && t.some((x) => x !== 0) ? [[row, ...t.map(short)]] : []));
  }
  if (view.camera) packed.c = [view.camera.position.map(short), view.camera.target.map(short)];
  if (view.layers) packed.l = view.layers.map(({ name, visible, opacity }) => [name, visible ? short(opacity) : -short(opacity) - 1]);
  if (view.seeThrough !== null) packed.g = view.seeThrough;
  return `#${new URLSearchParams({ model, [KEY]: base64(JSON.stringify(packed)) })}`;
}

const isNumbers = (value: unknown, count?: number): value is number[] =>
  Array.isArray(value) && (count === undefined || value.length === count) && value.every((x) => typeof x === "number" && Number.isFinite(x));

/** What the fragment of a page's address holds; null where it holds no view, or one that cannot be read. */
export function readLink(fragment: string): ((rig: Rig) => LinkedView) | null {
  const text = new URLSearchParams(fragment.replace(/^#/, "")).get(KEY);
  if (!text) return null;
  let packed: Packed;
  try {
    packed = JSON.parse(unbase64(text)) as Packed;
  } catch {
    return null;
  }
  if (typeof packed !== "object" || packed === null || packed.v !== VERSION) return null;
  return (rig) => ({
    pose: poseIn(packed, rig),
    camera: isNumbers(packed.c?.[0], 3) && isNumbers(packed.c[1], 3) ? { position: packed.c[0], target: packed.c[1] } : null,
    layers: Array.isArray(packed.l) ? packed.l.flatMap(layerIn) : null,
    seeThrough: typeof packed.g === "boolean" ? packed.g : null,
  });
}

function layerIn(entry: unknown): LinkedLayer[] {
  if (!Array.isArray(entry) || typeof entry[0] !== "string" || !isNumbers([entry[1]])) return [];
  const [name, shown] = entry as [string, number];
  const opacity = Math.min(1, Math.max(0, shown >= 0 ? shown : -shown - 1));
  return [{ name, visible: shown >= 0, opacity }];
}

function poseIn(packed: Packed, rig: Rig): Pose | null {
  if (!isNumbers(packed.t, 3) || !Array.isArray(packed.q)) return null;
  const rotation: number[] = rig.segments.flatMap(() => [1, 0, 0, 0]);
  for (const entry of packed.q) {
    const row = isNumbers(entry, 5) ? entry[0]! : -1;
    const q = entry.slice(1) as unknown as Quat;
    const size = Math.hypot(...q);
    // A pose of another skeleton, or of none: better the scan than half of it.
    if (!Number.isInteger(row) || row < 0 || row >= rig.segments.length || Math.abs(size - 1) > 1e-3) return null;
    q.forEach((x, i) => { rotation[4 * row + i] = x / size; });
  }
  const [x, y, z] = packed.t as [number, number, number];
  const wire: WirePose = {
    rootTranslation: { x, y, z }, rotation,
    translation: (packed.s ?? []).flatMap((entry) => (isNumbers(entry, 4) ?
      [{ joint: entry[0]!, offset: { x: entry[1]!, y: entry[2]!, z: entry[3]! } }] : [])),
  };
  return poseOf(rig, wire);
}
