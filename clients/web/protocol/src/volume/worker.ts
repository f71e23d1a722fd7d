// SPDX-License-Identifier: Apache-2.0
// Decodes volumes in a thread of its own, so that a page goes on while megabytes are unpacked. One worker a stream.
import { describeFault } from "../errors.js";
import { ProtocolError } from "../framing.js";
import type { FromDecoder, ToDecoder } from "./channel.js";
import { VolumeDecoder } from "./decoder.js";
import { inflate } from "./zstd.js";

const scope = self as unknown as DedicatedWorkerGlobalScope;
const decoder = new VolumeDecoder(inflate);

scope.addEventListener("message", ({ data: { frame, payload } }: MessageEvent<ToDecoder>) => {
  const post = (message: FromDecoder, transfer: Transferable[] = []) => scope.postMessage(message, transfer);
  try {
    const image = decoder.decode(frame, payload);
    post({ kind: "image", image }, [image.voxels.buffer]);
  } catch (error) {
    post(error instanceof ProtocolError ? { kind: "refused", message: error.message } : { kind: "failed", message: describeFault(error) });
  }
});
