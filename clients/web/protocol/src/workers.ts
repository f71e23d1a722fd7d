// SPDX-License-Identifier: Apache-2.0
// How workers are started: a page's way, unless another entry (node/index.ts) says otherwise.

/** What is used of a page's Worker. */
export type WorkerLike = Pick<Worker, "postMessage" | "terminate" | "onmessage" | "onmessageerror" | "onerror">;

export const workers = {
  make: (url: string | URL): WorkerLike => new Worker(url, { type: "module" }),
};
