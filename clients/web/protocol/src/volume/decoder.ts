// SPDX-License-Identifier: Apache-2.0
// The frames of one volume subscription as whole images, whatever was left out or compressed. The twin of proto/volume_decoder.cpp.
import { arrayOf, ProtocolError, type KnownScalar, type Numbers } from "../framing.js";
import { ScalarType, type Array as ArrayDescription } from "../gen/ecorche/v1/common_pb.js";
import type { Grid } from "../gen/ecorche/v1/model_pb.js";
import type { VolumeFrame } from "../gen/ecorche/v1/stream_pb.js";

type Three = readonly [number, number, number];

/** Voxel (i, j, k) is centred at origin + direction * (spacing .* (i, j, k)), mm, LPS; i runs fastest. */
export interface VolumeGrid {
  readonly size: Three;
  readonly origin: Three;
  readonly spacing: Three;
  /** Nine, row-major; columns are the axes. */
  readonly direction: readonly number[];
}

export interface VolumeImage {
  readonly grid: VolumeGrid;
  readonly type: KnownScalar;
  /** Numbers of a voxel, beside each other. */
  readonly components: number;
  readonly voxels: Numbers;
}

/** Of a frame that is not compressed into `size` bytes: throws ProtocolError for what is not. */
export type Inflate = (packed: Uint8Array, size: number) => Uint8Array<ArrayBuffer>;

/** What one array of a browser holds for sure. */
const MOST_BYTES = 2 ** 31 - 1;
/** A block of zstd that repeats one byte: 128 KiB out of 4 bytes. */
const MOST_RATIO = 2 ** 15;
const MOST_COMPONENTS = 16;
export const BRICK = 32;
const BYTES: Record<KnownScalar, number> = {
  [ScalarType.U8]: 1, [ScalarType.I8]: 1, [ScalarType.U16]: 2, [ScalarType.I16]: 2,
  [ScalarType.U32]: 4, [ScalarType.I32]: 4, [ScalarType.F32]: 4, [ScalarType.F64]: 8,
};

interface Keyframe {
  readonly number: bigint;
  readonly image: VolumeImage;
}

export class VolumeDecoder {
  #keyframe: Keyframe | null = null;

  constructor(private readonly inflate: Inflate) {}

  /** An image of its own. Throws ProtocolError for arrays that are not what the frame says, and for bricks against a keyframe that did
   *  not come. VolumeFrame.status is the caller's to look at, and slices have no grid. */
  decode(frame: VolumeFrame, payload: Uint8Array<ArrayBuffer>): VolumeImage {
    const grid = gridOf(frame.grid);
    const { type, components, voxels } = this.#voxels(frame, payload);
    const count = grid.size[0] * grid.size[1] * grid.size[2];
    if (frame.bricks) {
      const image = this.#fromKeyframe(frame, grid, type, components);
      putBricks(arrayOf(frame.bricks, payload, ScalarType.U32, 1), voxels, image);
      return image;
    }
    if (voxels.length !== count * components) throw new ProtocolError(`${voxels.length / components} voxels in a grid of ${count}`);
    const image: VolumeImage = { grid, type, components, voxels };
    if (frame.keyframe !== 0n) this.#keyframe = { number: frame.frame, image: { ...image, voxels: voxels.slice() } };
    return image;
  }

  #voxels({ content, voxels }: VolumeFrame, payload: Uint8Array<ArrayBuffer>): { type: KnownScalar; components: number; voxels: Numbers } {
    const described: ArrayDescription | undefined = content ?? voxels;
    const type: KnownScalar = (described?.type ?? 0) as KnownScalar, components = described?.components ?? 0;
    if (!described || !(type in BYTES) || components < 1 || components > MOST_COMPONENTS) throw new ProtocolError("voxels of no type");
    if (!content) return { type, components, voxels: arrayOf(voxels, payload, type, components) as Numbers };
    const packed = arrayOf(voxels, payload, ScalarType.U8, 1), bytes = content.count * BigInt(BYTES[type] * components);
    if (content.offset !== 0n || bytes > BigInt(MOST_BYTES) || bytes > BigInt(packed.length) * BigInt(MOST_RATIO)) {
      throw new ProtocolError(`${packed.length} bytes that say they hold ${bytes}`);
    }
    return { type, components, voxels: arrayOf(content, this.inflate(packed, Number(bytes)), type, components) as Numbers };
  }

  #fromKeyframe(frame: VolumeFrame, grid: VolumeGrid, type: KnownScalar, components: number): VolumeImage {
    const keyframe = this.#keyframe;
    if (!keyframe || frame.keyframe === 0n || keyframe.number !== frame.keyframe) {
      throw new ProtocolError(`frame ${frame.frame} is against keyframe ${frame.keyframe}, which did not come`);
    }
    const { image } = keyframe;
    if (image.type !== type || image.components !== components || JSON.stringify(image.grid) !== JSON.stringify(grid)) {
      throw new ProtocolError("bricks of another grid than their keyframe's");
    }
    return { ...image, voxels: image.voxels.slice() };
  }
}

/** Throws ProtocolError for what is no grid, or holds more than an array can. */
export function gridOf(grid: Grid | undefined): VolumeGrid {
  const { origin, spacing } = grid ?? {};
  if (!grid || !origin || !spacing) throw new ProtocolError("a volume without its grid");
  const made: VolumeGrid = {
    size: [grid.sizeI, grid.sizeJ, grid.sizeK], origin: [origin.x, origin.y, origin.z], spacing: [spacing.x, spacing.y, spacing.z], direction: grid.direction,
  };
  const numbers = [...made.origin, ...made.spacing, ...made.direction];
  if (made.direction.length !== 9 || !numbers.every(Number.isFinite) || made.spacing.some((each) => each <= 0) || made.size.some((each) => each < 1)) {
    throw new ProtocolError("a volume whose grid is none");
  }
  if (made.size[0] * made.size[1] * made.size[2] > MOST_BYTES) throw new ProtocolError(`a volume of ${made.size.join(" x ")} voxels is too large for a browser`);
  return made;
}

/** Copies bricks into an image. */
function putBricks(bricks: Uint32Array, voxels: Numbers, { grid: { size }, components, voxels: out }: VolumeImage): void {
  const count = size.map((each) => Math.ceil(each / BRICK));
  let at = 0, before = -1;
  for (const brick of bricks) {
    if (brick <= before || brick >= count[0] * count[1] * count[2]) throw new ProtocolError("bricks that are not those of the grid");
    before = brick;
    const place = [brick % count[0], Math.floor(brick / count[0]) % count[1], Math.floor(brick / (count[0] * count[1]))];
    const first = place.map((each) => BRICK * each), last = first.map((each, axis) => Math.min(each + BRICK, size[axis]));
    const run = (last[0] - first[0]) * components;
    if (voxels.length - at < run * (last[1] - first[1]) * (last[2] - first[2])) throw new ProtocolError("bricks that are cut short");
    for (let k = first[2]; k < last[2]; ++k) {
      for (let j = first[1]; j < last[1]; ++j) {
        out.set(voxels.subarray(at, at + run), (first[0] + size[0] * (j + size[1] * k)) * components);
        at += run;
      }
    }
  }
  if (at !== voxels.length) throw new ProtocolError("something follows the last brick");
}
