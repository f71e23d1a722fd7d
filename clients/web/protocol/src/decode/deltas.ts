// SPDX-License-Identifier: Apache-2.0
// Deltas of u16 positions against a keyframe (docs/reference/protocol.md, "Deltas"): plain numbers, the twin of deltas.c.
import { ProtocolError } from "../framing.js";
import { STRIDE } from "./packed.js";

const BLOCK = 512, LANES = 32, HEADER_BYTES = 34, MOVED_ONLY = 255;

const wrap = (x: number): number => (x << 16) >> 16;

/** Where the numbers of one axis stand, and how to take row after row out of them. */
interface Plane {
  start: number;  // in words of 16 bits
  width: number;
}

/**
 * `data`: the deltas of one tissue. `key`, `out`: its vertices, STRIDE numbers each, of which the first three are positions; the
 * fourth is left as it is.
 */
export function decodeDeltas(data: Uint8Array, key: Uint16Array, out: Uint16Array): void {
  const vertices = out.length / STRIDE;
  if (data.length % 2 !== 0 || data.byteOffset % 2 !== 0) throw new ProtocolError("deltas of an odd length");
  const words = new Uint16Array(data.buffer, data.byteOffset, data.length / 2);
  let at = 0;
  for (let first = 0; first < vertices; first += BLOCK) {
    at = decodeBlock(words, at, key, out, first, Math.min(BLOCK, vertices - first));
  }
  if (at !== words.length) throw new ProtocolError("the deltas go on behind their last block");
}

/** Returns where the next block begins, in words. */
function decodeBlock(words: Uint16Array, at: number, key: Uint16Array, out: Uint16Array, first: number, vertices: number): number {
  const rows = Math.ceil(vertices / LANES);
  if (at + HEADER_BYTES / 2 > words.length) throw new ProtocolError("the deltas end too early");
  const digits = words[at] & 255;
  if (digits > 9 && digits !== MOVED_ONLY) throw new ProtocolError(`a block of deltas with ${digits} digits`);
  const widths = [words[at] >> 8, words[at + 1] & 255, words[at + 1] >> 8];
  const matrix = words.subarray(at + 2, at + 11), centre = words.subarray(at + 11, at + 14), base = words.subarray(at + 14, at + 17);
  at += HEADER_BYTES / 2;
  const planes = widths.map((width): Plane => {
    if (width > 16) throw new ProtocolError(`deltas of ${width} bits`);
    const start = at;
    at += LANES * Math.ceil(rows * width / 16);
    return { start, width };
  });
  if (at > words.length) throw new ProtocolError("the deltas end too early");
  for (let axis = 0; axis < 3; ++axis) {
    unpack(words, planes[axis], base[axis], out, first * STRIDE + axis, vertices);
  }
  if (digits === MOVED_ONLY) shift(key, centre, out, first, vertices);
  else turn(key, centre, matrix, digits, out, first, vertices);
  return at;
}

/** base + left of one axis; a lane's bits stand in its words lowest first, row after row. */
function unpack(words: Uint16Array, plane: Plane, base: number, out: Uint16Array, place: number, vertices: number): void {
  const { start, width } = plane, mask = (1 << width) - 1;
  for (let v = 0; v < vertices; ++v) {
    const bit = (v >> 5) * width, under = bit & 15;
    const word = start + LANES * (bit >> 4) + (v & 31);
    let left = width === 0 ? 0 : words[word] >> under;
    if (under + width > 16) left |= words[word + LANES] << (16 - under);
    out[place + STRIDE * v] = base + (left & mask);
  }
}

function shift(key: Uint16Array, centre: Uint16Array, out: Uint16Array, first: number, vertices: number): void {
  for (let i = first * STRIDE; i < (first + vertices) * STRIDE; i += STRIDE) {
    out[i] += key[i] - centre[0];
    out[i + 1] += key[i + 1] - centre[1];
    out[i + 2] += key[i + 2] - centre[2];
  }
}

function turn(
  key: Uint16Array, centre: Uint16Array, matrix: Uint16Array, digits: number, out: Uint16Array, first: number, vertices: number,
): void {
  const [a, b, c, d, e, f, g, h, i] = new Int16Array(matrix), half = digits > 0 ? 1 << (digits - 1) : 0, up = digits + 2;
  const [cx, cy, cz] = centre;
  for (let at = first * STRIDE; at < (first + vertices) * STRIDE; at += STRIDE) {
    const x = wrap((key[at] - cx) << up), y = wrap((key[at + 1] - cy) << up), z = wrap((key[at + 2] - cz) << up);
    out[at] += wrap(rounded(a * x) + rounded(b * y) + rounded(c * z) + half) >> digits;
    out[at + 1] += wrap(rounded(d * x) + rounded(e * y) + rounded(f * z) + half) >> digits;
    out[at + 2] += wrap(rounded(g * x) + rounded(h * y) + rounded(i * z) + half) >> digits;
  }
}

/** A product of 16 bits times 16 bits in 32, to 16: what i16x8.q15mulr does, but that -1 times -1 wraps. */
const rounded = (product: number): number => wrap((product + (1 << 14)) >> 15);
