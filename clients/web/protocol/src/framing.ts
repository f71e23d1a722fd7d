// SPDX-License-Identifier: Apache-2.0
// The bytes of one frame (docs/reference/protocol.md, "A frame"), and the arrays within its payload. Trusts nothing.
import { ScalarType, type Array as ArrayDescription } from "./gen/ecorche/v1/common_pb.js";

const ALIGNMENT = 16;
const HEAD_BYTES = 8;

/** The peer broke the protocol: the connection is lost. */
export class ProtocolError extends Error {
  override name = "ProtocolError";
}

const aligned = (size: number): number => Math.ceil(size / ALIGNMENT) * ALIGNMENT;

export function encodeFrame(envelope: Uint8Array, payload: Uint8Array = new Uint8Array()): Uint8Array<ArrayBuffer> {
  if (envelope.length === 0) throw new ProtocolError("an envelope must not be empty (set a member of the message)");
  const start = aligned(HEAD_BYTES + envelope.length);
  const frame = new Uint8Array(start + aligned(payload.length));
  const head = new DataView(frame.buffer);
  head.setUint32(0, envelope.length, true);
  head.setUint32(4, aligned(payload.length), true);
  frame.set(envelope, HEAD_BYTES);
  frame.set(payload, start);
  return frame;
}

export interface Frame {
  envelope: Uint8Array<ArrayBuffer>;
  payload: Uint8Array<ArrayBuffer>;
}

/** `message` is one whole frame; both parts are views of it. */
export function decodeFrame(message: ArrayBuffer): Frame {
  if (message.byteLength < HEAD_BYTES) throw new ProtocolError(`a frame of ${message.byteLength} bytes has no head`);
  const head = new DataView(message);
  const envelopeBytes = head.getUint32(0, true), payloadBytes = head.getUint32(4, true);
  const start = aligned(HEAD_BYTES + envelopeBytes);
  if (envelopeBytes === 0) throw new ProtocolError("a frame without an envelope");
  if (payloadBytes % ALIGNMENT !== 0) throw new ProtocolError(`a payload of ${payloadBytes} bytes is no multiple of ${ALIGNMENT}`);
  if (start + payloadBytes !== message.byteLength) {
    throw new ProtocolError(`a frame of ${message.byteLength} bytes tells of ${envelopeBytes} and ${payloadBytes}`);
  }
  const bytes = new Uint8Array(message);
  for (let i = HEAD_BYTES + envelopeBytes; i < start; ++i) {
    if (bytes[i] !== 0) throw new ProtocolError("the padding of a frame is not zero");
  }
  return {
    envelope: bytes.subarray(HEAD_BYTES, HEAD_BYTES + envelopeBytes),
    payload: bytes.subarray(start),
  };
}

const TYPES = {
  [ScalarType.U8]: Uint8Array,
  [ScalarType.I8]: Int8Array,
  [ScalarType.U16]: Uint16Array,
  [ScalarType.I16]: Int16Array,
  [ScalarType.U32]: Uint32Array,
  [ScalarType.I32]: Int32Array,
  [ScalarType.F32]: Float32Array,
  [ScalarType.F64]: Float64Array,
} as const;
type Types = typeof TYPES;
export type KnownScalar = keyof Types;
/** An array of any of them. */
export type Numbers =
  | Uint8Array<ArrayBuffer> | Int8Array<ArrayBuffer> | Uint16Array<ArrayBuffer> | Int16Array<ArrayBuffer>
  | Uint32Array<ArrayBuffer> | Int32Array<ArrayBuffer> | Float32Array<ArrayBuffer> | Float64Array<ArrayBuffer>;

/** The numbers that `description` names: a view of the payload, which they must lie within and be of this type and width. */
export function arrayOf<T extends KnownScalar>(
  description: ArrayDescription | undefined, payload: Uint8Array<ArrayBuffer>, type: T, components: number,
): InstanceType<Types[T]> {
  if (!description) throw new ProtocolError("an array is missing");
  if (description.type !== type || description.components !== components) {
    throw new ProtocolError(`an array of type ${description.type} x ${description.components}, expected ${type} x ${components}`);
  }
  const Typed = TYPES[type];
  const bytes = description.count * BigInt(components * Typed.BYTES_PER_ELEMENT);
  if (description.offset % BigInt(ALIGNMENT) !== 0n || description.offset + bytes > BigInt(payload.length)) {
    throw new ProtocolError(`an array of ${bytes} bytes at ${description.offset} reaches beyond its payload of ${payload.length}`);
  }
  const at = payload.byteOffset + Number(description.offset);
  return new Typed(payload.buffer, at, Number(description.count) * components) as InstanceType<Types[T]>;
}

/** An array as one writes it into the payload of a request; `count` rows from its beginning. */
export function describe(type: KnownScalar, components: number, count: number) {
  return { type, components, count: BigInt(count), offset: 0n };
}
