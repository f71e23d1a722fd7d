// SPDX-License-Identifier: Apache-2.0
// What a stream of volumes and its decoder say to each other, across threads.
import type { VolumeFrame } from "../gen/ecorche/v1/stream_pb.js";
import type { VolumeImage } from "./decoder.js";

export interface ToDecoder {
  frame: VolumeFrame;
  payload: Uint8Array<ArrayBuffer>;
}

export type FromDecoder =
  | { kind: "image"; image: VolumeImage }
  /** The peer broke the protocol. */
  | { kind: "refused"; message: string }
  /** A fault of our own code. */
  | { kind: "failed"; message: string };
