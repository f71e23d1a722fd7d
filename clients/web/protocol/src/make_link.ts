// SPDX-License-Identifier: Apache-2.0
// A link with the best that this thread has: WebAssembly SIMD, memory that threads share.
import type { Post, ToClient } from "./channel.js";
import { makePlainKernel } from "./decode/kernel.js";
import { loadWasmKernel } from "./decode/wasm_kernel.js";
import { unpackingReady } from "./layout.js";
import { Link } from "./link.js";
import { compilesWebAssembly } from "./webassembly.js";

/** Shared memory is there in pages that are cross-origin isolated, and in node. */
export const threadsShareMemory = (): boolean => typeof SharedArrayBuffer !== "undefined" && globalThis.crossOriginIsolated !== false;

export async function makeLink(post: Post<ToClient>): Promise<Link> {
  // Where a page's policy forbids the unpacker, nothing packed is asked for.
  const [kernel] = await Promise.all([loadWasmKernel(), compilesWebAssembly() ? unpackingReady : undefined]);
  return new Link({ makeKernel: kernel ?? makePlainKernel, shared: threadsShareMemory() }, post);
}
