// SPDX-License-Identifier: Apache-2.0
// Points of the posed body back to the scan, or the other way.
import { create } from "@bufbuild/protobuf";
import { arrayOf, describe } from "./framing.js";
import { ScalarType, type Array as ArrayDescription } from "./gen/ecorche/v1/common_pb.js";
import { ProbePoints_Direction, ProbePointsSchema, type Probed as ProbedMessage } from "./gen/ecorche/v1/command_pb.js";
import type { Message } from "./requests.js";

export interface ProbeOptions {
  /** From the scan into the posed body; else from the posed body to the scan. */
  toPosed?: boolean;
  /** Names of volumes to sample there. */
  volumes?: string[];
  gradient?: boolean;
  tissue?: boolean;
}

/** A row for each point. */
export interface Probed {
  poseSequence: bigint;
  /** 3 each, mm, LPS; NaN outside the body. */
  points: Float64Array;
  /** Row of ModelOpened.tissues, -1: none. */
  tissue: Int32Array | undefined;
  /** The components of every volume in turn. */
  values: Float64Array | undefined;
  /** 9 each, row-major. */
  gradient: Float64Array | undefined;
}

export function encodeProbe(points: ArrayLike<number>, options: ProbeOptions): { message: Message; payload: Uint8Array } {
  if (points.length === 0 || points.length % 3 !== 0) throw new Error(`${points.length} numbers are no points (give 3 for each)`);
  const value = create(ProbePointsSchema, {
    direction: options.toPosed ? ProbePoints_Direction.REST_TO_POSED : ProbePoints_Direction.POSED_TO_REST,
    points: describe(ScalarType.F64, 3, points.length / 3),
    volumes: options.volumes ?? [], deformationGradient: options.gradient ?? false, tissue: options.tissue ?? false,
  });
  return { message: { case: "probePoints", value }, payload: new Uint8Array(Float64Array.from(points).buffer) };
}

export function readProbe(probed: ProbedMessage, payload: Uint8Array): Probed {
  const bytes = payload as Uint8Array<ArrayBuffer>;
  const doubles = (array: ArrayDescription | undefined, components: number) => array && arrayOf(array, bytes, ScalarType.F64, components);
  return {
    poseSequence: probed.poseSequence,
    points: arrayOf(probed.points, bytes, ScalarType.F64, 3),
    tissue: probed.tissue && arrayOf(probed.tissue, bytes, ScalarType.I32, 1),
    values: doubles(probed.values, probed.values?.components ?? 1),
    gradient: doubles(probed.deformationGradient, 9),
  };
}
