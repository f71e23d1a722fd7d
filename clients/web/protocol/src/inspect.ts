// SPDX-License-Identifier: Apache-2.0
// What a client asks of the present pose beside the stream: a radiograph, and numbers at the vertices.
import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { arrayOf } from "./framing.js";
import { ScalarType } from "./gen/ecorche/v1/common_pb.js";
import {
  RenderRadiograph_Content, RenderRadiographSchema, SampleField_Kind, SampleFieldSchema, type Field as FieldMessage, type Radiograph as RadiographMessage,
} from "./gen/ecorche/v1/inspect_pb.js";
import type { Message } from "./requests.js";

/** As in proto/ecorche/v1/inspect.proto; what is left out is as there. */
export type RadiographOptions = Omit<MessageInitShape<typeof RenderRadiographSchema>, "$typeName">;

export interface Radiograph {
  /** How it was made: pose, source, detector, sizes. */
  readonly message: RadiographMessage;
  /** Row by row from the top: line integrals as float32, else grey values. */
  readonly picture: Float32Array | Uint16Array | Uint8Array;
}

export function encodeRadiograph(options: RadiographOptions): Message {
  return { case: "renderRadiograph", value: create(RenderRadiographSchema, options) };
}

export function readRadiograph(message: RadiographMessage, content: RenderRadiograph_Content, payload: Uint8Array): Radiograph {
  const bytes = payload as Uint8Array<ArrayBuffer>;
  switch (content) {
    case RenderRadiograph_Content.GREY_16: return { message, picture: arrayOf(message.picture, bytes, ScalarType.U16, 1) };
    case RenderRadiograph_Content.GREY_8: return { message, picture: arrayOf(message.picture, bytes, ScalarType.U8, 1) };
    default: return { message, picture: arrayOf(message.picture, bytes, ScalarType.F32, 1) };
  }
}

/** det F, or the weight of a segment (its row). `tissues`: names; none: all. */
export interface FieldOptions {
  of: "det F" | { segment: number };
  tissues?: string[];
}

export interface Field {
  readonly poseSequence: bigint;
  /** By row of ModelOpened.tissues: a number for each vertex of the tissue. */
  readonly values: ReadonlyMap<number, Float32Array>;
  readonly least: number;
  readonly most: number;
}

export function encodeField({ of, tissues = [] }: FieldOptions): Message {
  const kind = of === "det F" ? SampleField_Kind.DET_F : SampleField_Kind.WEIGHT;
  return { case: "sampleField", value: create(SampleFieldSchema, { kind, segment: of === "det F" ? 0 : of.segment, tissues }) };
}

export function readField(field: FieldMessage, payload: Uint8Array): Field {
  const bytes = payload as Uint8Array<ArrayBuffer>;
  return {
    poseSequence: field.poseSequence, least: field.least, most: field.most,
    values: new Map(field.parts.map(({ tissue, values }) => [tissue, arrayOf(values, bytes, ScalarType.F32, 1).slice()])),
  };
}
