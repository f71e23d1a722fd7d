// SPDX-License-Identifier: Apache-2.0
// The balls that pose a volume, and what they hang on.
import { create } from "@bufbuild/protobuf";
import { arrayOf, describe, ProtocolError } from "./framing.js";
import { HangSpheresSchema, Spheres_Metric, type Spheres as SpheresMessage } from "./gen/ecorche/v1/command_pb.js";
import { ScalarType } from "./gen/ecorche/v1/common_pb.js";
import type { Message } from "./requests.js";
import { gridOf, type VolumeGrid } from "./volume/decoder.js";

/** A row for each ball. */
export interface Spheres {
  readonly name: string;
  readonly grid: VolumeGrid;
  readonly metric: "euclidean" | "chamfer345";
  readonly thinness: number;
  /** 3 each. */
  readonly voxels: Uint16Array<ArrayBuffer>;
  /** Squared, voxels; of chamfer345 3 a step. */
  readonly distance: Uint32Array<ArrayBuffer>;
  readonly deficit: Float32Array<ArrayBuffer>;
  /** Row towards the root, -1 there; null: there is no tree. */
  readonly parent: Int32Array<ArrayBuffer> | null;
  /** Rows of Skeleton.segments. */
  readonly segment: Int32Array<ArrayBuffer>;
  /** 3 for each segment, mm, LPS. */
  readonly joints: Float64Array<ArrayBuffer>;
  readonly byHand: boolean;
}

/** `segments`: of the model's skeleton. */
export function readSpheres(message: SpheresMessage, payload: Uint8Array<ArrayBuffer>, segments: number): Spheres {
  const grid = gridOf(message.grid), voxels = arrayOf(message.voxels, payload, ScalarType.U16, 3).slice(), count = voxels.length / 3;
  const metric = message.metric === Spheres_Metric.EUCLIDEAN ? "euclidean" : message.metric === Spheres_Metric.CHAMFER345 ? "chamfer345" : null;
  if (!metric) throw new ProtocolError("balls of no metric");
  const distance = arrayOf(message.distance, payload, ScalarType.U32, 1).slice(), deficit = arrayOf(message.deficit, payload, ScalarType.F32, 1).slice();
  const parent = message.parent ? arrayOf(message.parent, payload, ScalarType.I32, 1).slice() : null;
  const segment = arrayOf(message.segment, payload, ScalarType.I32, 1).slice(), joints = arrayOf(message.joints, payload, ScalarType.F64, 3).slice();
  if ([distance, deficit, segment, ...(parent ? [parent] : [])].some(({ length }) => length !== count)) throw new ProtocolError("arrays of balls that do not go together");
  if (joints.length !== 3 * segments) throw new ProtocolError(`${joints.length / 3} joints for ${segments} segments`);
  if (voxels.some((at, i) => at >= grid.size[i % 3])) throw new ProtocolError("a ball outside of its lattice");
  if (parent?.some((row) => row < -1 || row >= count) || segment.some((row) => row < -1 || row >= segments)) throw new ProtocolError("a ball that hangs on nothing");
  return { name: message.name, grid, metric, thinness: message.thinness, voxels, distance, deficit, parent, segment, joints, byHand: message.byHand };
}

/** What is left out is as the model has it. */
export function encodeHang(volume: string, segment: Int32Array | null, joints: Float64Array | null): { message: Message; payload: Uint8Array } {
  const first = segment ? Math.ceil((4 * segment.length) / 16) * 16 : 0;
  const payload = new Uint8Array(first + (joints ? 8 * joints.length : 0));
  if (segment) new Int32Array(payload.buffer, 0, segment.length).set(segment);
  if (joints) new Float64Array(payload.buffer, first, joints.length).set(joints);
  const value = create(HangSpheresSchema, {
    volume, ...(segment && { segment: describe(ScalarType.I32, 1, segment.length) }),
    ...(joints && { joints: { ...describe(ScalarType.F64, 3, joints.length / 3), offset: BigInt(first) } }),
  });
  return { message: { case: "hangSpheres", value }, payload };
}
