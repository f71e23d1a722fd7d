// SPDX-License-Identifier: Apache-2.0
// Skinning in plain TypeScript: the shaders' twin, line by line, and the way for who has no GPU.
import { NO_NORMAL, STRIDE } from "../decode/packed.js";
import { Skinning as Method } from "../gen/ecorche/v1/common_pb.js";
import { MOTION_FLOATS, type MotionTable } from "./motions.js";
import { POINT_NUMBERS, type Skinning } from "./skinning.js";

type Vector = [number, number, number];
/** Below this length a blend of quaternions has no direction: the heaviest segment's stands for it. */
const VANISHED = 1e-3, MIDDLE = 32768, WHOLE = 65535;

const plus = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a: Vector, f: number): Vector => [a[0] * f, a[1] * f, a[2] * f];
const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** By a unit quaternion of these. */
function turned(r: Vector, w: number, v: Vector): Vector {
  const t = times(cross(r, v), 2);
  return plus(v, plus(times(t, w), cross(r, t)));
}

/** `out`: STRIDE numbers a vertex, as frames have them, in the box of `motions`. */
export function skinOnCpu(skinning: Skinning, motions: MotionTable, method: Method, out: Uint16Array): void {
  const { points, weights, influences, box, hung, hungNodes, hungShares, vertexCount } = skinning, { rows } = motions;
  const place = (point: number, part: 0 | 4): Vector => {
    const at = point * POINT_NUMBERS + part;
    return [(points[at] - MIDDLE) * box.scale, (points[at + 1] - MIDDLE) * box.scale, (points[at + 2] - MIDDLE) * box.scale];
  };

  function skin(point: number, normal: Vector): { at: Vector; normal: Vector } {
    const y = place(point, 0), c = method === Method.COR || method === Method.UNSPECIFIED ? place(point, 4) : y;
    let at: Vector = [0, 0, 0], r: Vector = [0, 0, 0], w = 0, dual: Vector = [0, 0, 0], dualW = 0;
    let x0: Vector = [0, 0, 0], x1: Vector = [0, 0, 0], x2: Vector = [0, 0, 0];
    for (let k = 0; k < influences; ++k) {
      const share = weights[2 * (point * influences + k) + 1] / WHOLE;
      if (share === 0) break;
      const from = MOTION_FLOATS * weights[2 * (point * influences + k)];
      const qr: Vector = [rows[from], rows[from + 1], rows[from + 2]], qw = rows[from + 3], t: Vector = [rows[from + 4], rows[from + 5], rows[from + 6]];
      r = plus(r, times(qr, share));
      w += qw * share;
      if (method === Method.DQS) {
        dual = plus(dual, times(plus(times(t, qw), cross(t, qr)), share / 2));
        dualW -= (dot(t, qr) * share) / 2;
        continue;
      }
      at = plus(at, times(plus(turned(qr, qw, c), t), share));
      if (method !== Method.LBS) continue;
      x0 = plus(x0, times(turned(qr, qw, [1, 0, 0]), share));
      x1 = plus(x1, times(turned(qr, qw, [0, 1, 0]), share));
      x2 = plus(x2, times(turned(qr, qw, [0, 0, 1]), share));
    }
    // The cofactor of the blended matrix.
    if (method === Method.LBS) return { at, normal: plus(plus(times(cross(x1, x2), normal[0]), times(cross(x2, x0), normal[1])), times(cross(x0, x1), normal[2])) };
    let length = Math.hypot(r[0], r[1], r[2], w);
    if (length < VANISHED) {
      const from = MOTION_FLOATS * weights[2 * point * influences], t: Vector = [rows[from + 4], rows[from + 5], rows[from + 6]];
      r = [rows[from], rows[from + 1], rows[from + 2]];
      w = rows[from + 3];
      dual = times(plus(times(t, w), cross(t, r)), 0.5);
      dualW = -dot(t, r) / 2;
      length = 1;
    }
    r = times(r, 1 / length);
    w /= length;
    if (method === Method.DQS) {
      dual = times(dual, 1 / length);
      dualW /= length;
      return { at: plus(turned(r, w, y), times(plus(minus(times(dual, w), times(r, dualW)), cross(r, dual)), 2)), normal: turned(r, w, normal) };
    }
    return { at: plus(at, turned(r, w, minus(y, c))), normal: turned(r, w, normal) };
  }

  const steps = 1 / motions.box.scale;
  for (let vertex = 0; vertex < vertexCount; ++vertex) {
    const coded = points[vertex * POINT_NUMBERS + 3], still = normalOf(coded), row = hung[vertex];
    let { at, normal } = row === 0 ? skin(vertex, still) : { at: still, normal: still };
    if (row !== 0) {
      const nodes = [0, 1, 2, 3].map((c) => hungNodes[4 * (row - 1) + c]), posed = nodes.map((node) => skin(node, still).at);
      at = posed.reduce<Vector>((sum, node, c) => plus(sum, times(node, hungShares[4 * (row - 1) + c])), [0, 0, 0]);
      const [e1, e2, e3] = [1, 2, 3].map((c) => minus(posed[c], posed[0]));
      const [g1, g2, g3] = [1, 2, 3].map((c) => dot(still, minus(place(nodes[c], 0), place(nodes[0], 0))));
      normal = plus(plus(times(cross(e2, e3), g1), times(cross(e3, e1), g2)), times(cross(e1, e2), g3));
    }
    const to = vertex * STRIDE;
    for (let axis = 0; axis < 3; ++axis) out[to + axis] = Math.min(65535, Math.max(0, at[axis] * steps + 0.5));
    out[to + 3] = coded === NO_NORMAL ? NO_NORMAL : codeOf(normal);
  }
}

function normalOf(coded: number): Vector {
  const u = ((coded & 255) - 128) / 127, v = ((coded >> 8) - 128) / 127, z = 1 - Math.abs(u) - Math.abs(v);
  const n: Vector = z < 0 ? [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1), z] : [u, v, z];
  return times(n, 1 / Math.hypot(...n));
}

function codeOf(n: Vector): number {
  const sum = Math.abs(n[0]) + Math.abs(n[1]) + Math.abs(n[2]);
  if (!(sum > 0)) return NO_NORMAL;
  let u = n[0] / sum, v = n[1] / sum;
  if (n[2] < 0) [u, v] = [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
  return (Math.floor(u * 127 + 128.5) & 255) | ((Math.floor(v * 127 + 128.5) & 255) << 8);
}
