// SPDX-License-Identifier: Apache-2.0
// A volume as the graphics card samples it: half floats, coarser where it would not fit its budget, and what each block of it holds, so
// that rays pass over what is empty.
import * as THREE from "three";
import type { Numbers, VolumeGrid, VolumeImage } from "../../../protocol/src/index.js";

/** Of the texture of the voxels, on the graphics card. */
export const BUDGET_BYTES = 192 << 20;
/** Voxels of the texture along an edge of a block. */
export const BLOCK = 8;
/** Whole numbers up to here are half floats as they are. */
const MOST = 2048;
const HALVES = new Uint16Array(2 * MOST + 1).map((_, at) => THREE.DataUtils.toHalfFloat(at - MOST));

/** Voxels that become one along each axis, so that the texture fits. */
export function coarseness(size: readonly number[], budget: number, mostSide: number): number {
  for (let factor = 1; ; ++factor) {
    const sides = size.map((side) => Math.ceil(side / factor));
    if (Math.max(...sides) <= mostSide && 2 * sides[0]! * sides[1]! * sides[2]! <= budget) return factor;
  }
}

/** stored = (value - middle) * scale, a whole number of at most 2048. */
export interface Coding {
  readonly middle: number;
  readonly scale: number;
}

export function codingOf(voxels: Numbers): Coding & { low: number; high: number } {
  let low = Infinity, high = -Infinity;
  for (const value of voxels) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (!(low <= high) || !Number.isFinite(high - low)) throw new Error("the volume holds values that are no numbers");
  const whole = !(voxels instanceof Float32Array || voxels instanceof Float64Array), half = (high - low) / 2;
  const middle = whole ? Math.round((low + high) / 2) : (low + high) / 2;
  return { low, high, middle, scale: half === 0 || (whole && half < MOST) ? 1 : MOST / half };
}

/** Means of cubes of `factor` voxels; at the far sides of what is left there. */
export function coarser(image: VolumeImage, factor: number): { size: [number, number, number]; values: Numbers | Float32Array } {
  const { grid: { size }, components, voxels } = image;
  if (factor === 1 && components === 1) return { size: [...size], values: voxels };
  const sides = size.map((side) => Math.ceil(side / factor)) as [number, number, number], values = new Float32Array(sides[0] * sides[1] * sides[2]);
  let to = 0;
  for (let k = 0; k < sides[2]; ++k) {
    for (let j = 0; j < sides[1]; ++j) {
      for (let i = 0; i < sides[0]; ++i, ++to) {
        const end = [i, j, k].map((each, axis) => Math.min(size[axis]!, (each + 1) * factor));
        let sum = 0;
        for (let z = k * factor; z < end[2]!; ++z) {
          for (let y = j * factor; y < end[1]!; ++y) {
            for (let x = i * factor; x < end[0]!; ++x) sum += voxels[(x + size[0] * (y + size[1] * z)) * components]!;
          }
        }
        values[to] = sum / ((end[0]! - i * factor) * (end[1]! - j * factor) * (end[2]! - k * factor));
      }
    }
  }
  return { size: sides, values };
}

export class VolumeTexture {
  readonly texture: THREE.Data3DTexture;
  readonly size: readonly [number, number, number];
  readonly coding: Coding;
  /** 1: every voxel; else so many along each axis became one. */
  readonly factor: number;
  /** From the patient's mm into the texture, 0 to 1. */
  readonly toTexture: THREE.Matrix4;
  /** mm along the texture's axes. */
  readonly extent: THREE.Vector3;
  readonly blocks: readonly [number, number, number];
  /** Lowest and highest value that a sample within each block may have. */
  readonly #lows: Int16Array;
  readonly #highs: Int16Array;

  constructor(image: VolumeImage, mostSide: number, budget = BUDGET_BYTES) {
    this.factor = coarseness(image.grid.size, budget, mostSide);
    const { size, values } = coarser(image, this.factor), coding = codingOf(values as Numbers);
    this.size = size;
    this.coding = coding;
    const stored = new Int16Array(values.length);
    for (let at = 0; at < values.length; ++at) stored[at] = Math.round((values[at]! - coding.middle) * coding.scale);
    const halves = new Uint16Array(stored.length);
    for (let at = 0; at < stored.length; ++at) halves[at] = HALVES[stored[at]! + MOST]!;
    this.texture = new THREE.Data3DTexture(halves, ...size);
    Object.assign(this.texture, {
      format: THREE.RedFormat, type: THREE.HalfFloatType, internalFormat: "R16F", minFilter: THREE.LinearFilter, magFilter: THREE.LinearFilter,
      unpackAlignment: 2, generateMipmaps: false, needsUpdate: true,
    });
    this.extent = new THREE.Vector3(...size.map((side, axis) => side * this.factor * image.grid.spacing[axis]!));
    this.toTexture = toTexture(image.grid, size, this.factor);
    this.blocks = size.map((side) => Math.ceil(side / BLOCK)) as [number, number, number];
    [this.#lows, this.#highs] = rangesOf(stored, size, this.blocks);
  }

  /** 255 for each block where `seen` says that something between its lowest and highest value can be seen. */
  occupied(seen: (low: number, high: number) => boolean): Uint8Array<ArrayBuffer> {
    const { middle, scale } = this.coding, value = (stored: number) => middle + stored / scale;
    return Uint8Array.from(this.#lows, (low, block) => (seen(value(low), value(this.#highs[block]!)) ? 255 : 0));
  }

  dispose(): void {
    this.texture.dispose();
  }
}

function toTexture({ origin, spacing, direction }: VolumeGrid, size: readonly number[], factor: number): THREE.Matrix4 {
  const axis = (column: number) => new THREE.Vector3(direction[column], direction[3 + column], direction[6 + column]).multiplyScalar(spacing[column]!);
  const toSpace = new THREE.Matrix4().makeBasis(axis(0), axis(1), axis(2)).setPosition(...origin as [number, number, number]);
  const [x, y, z] = size.map((side) => 1 / (side * factor)) as [number, number, number];
  return new THREE.Matrix4().makeScale(x, y, z).multiply(new THREE.Matrix4().makeTranslation(0.5, 0.5, 0.5)).multiply(toSpace.invert());
}

/** With the neighbours of a block, which a sample near its side is mixed with. */
function rangesOf(stored: Int16Array, size: readonly number[], blocks: readonly number[]): [Int16Array, Int16Array] {
  const count = blocks[0]! * blocks[1]! * blocks[2]!, lows = new Int16Array(count).fill(MOST), highs = new Int16Array(count).fill(-MOST);
  // The blocks that a voxel counts for, along an axis: its own, and one that it stands beside.
  const reach = (at: number, most: number) => [Math.max(0, Math.floor((at - 1) / BLOCK)), Math.min(most - 1, Math.floor((at + 1) / BLOCK))] as const;
  let from = 0;
  for (let k = 0; k < size[2]!; ++k) {
    const [k0, k1] = reach(k, blocks[2]!);
    for (let j = 0; j < size[1]!; ++j) {
      const [j0, j1] = reach(j, blocks[1]!);
      for (let i = 0; i < size[0]!; ++i, ++from) {
        const value = stored[from]!, [i0, i1] = reach(i, blocks[0]!);
        for (let z = k0; z <= k1; ++z) {
          for (let y = j0; y <= j1; ++y) {
            for (let x = i0; x <= i1; ++x) {
              const block = x + blocks[0]! * (y + blocks[1]! * z);
              if (value < lows[block]!) lows[block] = value;
              if (value > highs[block]!) highs[block] = value;
            }
          }
        }
      }
    }
  }
  return [lows, highs];
}
