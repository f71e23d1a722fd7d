// SPDX-License-Identifier: Apache-2.0
// Volumes as `ecorche pose` writes them (NRRD, raw or gzipped, along the patient's axes), read by hand.
import fs from "node:fs";
import zlib from "node:zlib";

type Three = [number, number, number];

export interface Volume {
  readonly sizes: Three;
  readonly origin: Three;
  readonly spacing: Three;
  readonly values: Int16Array | Uint8Array;
  /** At a voxel's centre; NaN where there is none within a thousandth of a mm. */
  at(point: readonly number[]): number;
}

export function readNrrd(file: string): Volume {
  const bytes = fs.readFileSync(file), end = bytes.indexOf("\n\n");
  const fields = new Map(bytes.subarray(0, end).toString("latin1").split("\n").filter((line) => /^[a-z ]+: /.test(line)).map((line) => line.split(": ", 2) as [string, string]));
  const numbers = (text: string) => (text.match(/-?\d+(?:\.\d+)?(?:e[-+]?\d+)?/gi) ?? []).map(Number);
  const field = (name: string) => {
    const value = fields.get(name);
    if (value === undefined) throw new Error(`${file} has no field ${name}`);
    return value;
  };
  const sizes = numbers(field("sizes")) as Three, origin = numbers(field("space origin")) as Three, axes = numbers(field("space directions"));
  const spacing: Three = [axes[0], axes[4], axes[8]];
  if (!field("space").startsWith("left-posterior-superior")) throw new Error(`${file} is in ${field("space")}`);
  if (axes.some((value, i) => i % 4 !== 0 && Math.abs(value) > 1e-9) || spacing.some((value) => value <= 0)) throw new Error(`${file} is not along LPS`);
  const raw = bytes.subarray(end + 2), data = field("encoding") === "raw" ? raw : zlib.gunzipSync(raw);
  const copy = Uint8Array.from(data).buffer;
  const values = /short|int16/.test(field("type")) ? new Int16Array(copy) : new Uint8Array(copy);
  return {
    sizes, origin, spacing, values,
    at: (point) => {
      const index = point.map((value, axis) => (value - origin[axis]) / spacing[axis]);
      const [i, j, k] = index.map(Math.round);
      if (index.some((value, axis) => Math.abs(value - Math.round(value)) * spacing[axis] > 1e-3 || value < -0.5 || value > sizes[axis] - 0.5)) return NaN;
      return values[i + sizes[0] * (j + sizes[1] * k)];
    },
  };
}
