// SPDX-License-Identifier: Apache-2.0
// A link with the best that this thread has: WebAssembly SIMD, memory that threads share.
import type { Post, ToClient } from "./channel.js";
import { makePlainKernel } from "./decode/kernel.js";
import { loadWasmKernel } from "./decode/wasm_kernel.js";
import { Link } from "./link.js";

/** Shared memory is there in pages that are cross-origin isolated, and in node. */
export const threadsShareMemory = (): boolean => typeof SharedArrayBuffer !== "undefined" && globalThis.crossOriginIsolated !== false;

export async function makeLink(post: Post<ToClient>): Promise<Link> {
  return new Link({ makeKernel: (await loadWasmKernel()) ?? makePlainKernel, shared: threadsShareMemory() }, post);
}
