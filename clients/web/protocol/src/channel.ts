// SPDX-License-Identifier: Apache-2.0
// What a client and its link say to each other, across threads or within one. Protobuf goes as bytes; frames of meshes go
// decoded (MeshFrame.arrays is left out of the envelope).
import type { Quantisation } from "./decode/packed.js";
import type { MeshLayout } from "./layout.js";
import type { Motions } from "./skinning/motions.js";
import type { Skinning } from "./skinning/skinning.js";

export type ToLink =
  | { kind: "dial"; url: string; hello: Uint8Array }
  /** `stream`: of a Subscribe, whose frames are then decoded for this stream. */
  | { kind: "send"; envelope: Uint8Array; payload?: Uint8Array; stream?: number }
  /** A buffer of a frame that has been drawn. */
  | { kind: "return"; stream: number; level: number; buffer: ArrayBuffer }
  | { kind: "forget"; stream: number }
  | { kind: "hang up" };

/** Tells of the newest frame of a stream: where its vertices are, and all else that it says. */
export interface FrameNote extends Quantisation {
  kind: "frame";
  stream: number;
  level: number;
  /** A MeshFrame without its arrays. */
  envelope: Uint8Array;
  /** Of the whole frame, on the wire. */
  bytes: number;
  decodeMs: number;
  /** Of publisher.ts, where slots are shared. */
  word?: number;
  /** Else the vertices themselves, to be returned. */
  buffer?: ArrayBuffer;
  /** Else what they are skinned by. */
  motions?: Motions;
}

export interface Statistics {
  framesPerSecond: number;
  bytesPerSecond: number;
  /** Of a Ping there and back; NaN until the first is answered. */
  latencyMs: number;
  /** Mean of the last second's frames. */
  decodeMs: number;
  /** How late the thread that receives was: it had no processor for so long. */
  lagMs: number;
}

export type ToClient =
  | { kind: "message"; envelope: Uint8Array; payload: Uint8Array }
  | { kind: "layouts"; stream: number; layouts: MeshLayout[]; skinning?: Skinning }
  /** Where a level's frames will be, once and before the first. */
  | { kind: "slots"; stream: number; level: number; slots: Uint16Array[]; control: Int32Array }
  | FrameNote
  | { kind: "statistics"; statistics: Statistics }
  /** The connection ended or never began. */
  | { kind: "closed"; code: number; reason: string }
  /** The peer's bytes are no such protocol: the connection is ended. */
  | { kind: "refused"; message: string }
  /** A fault of our own code. */
  | { kind: "failed"; message: string };

export type Post<Message> = (message: Message, transfer?: ArrayBuffer[]) => void;
