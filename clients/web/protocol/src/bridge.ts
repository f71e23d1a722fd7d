// SPDX-License-Identifier: Apache-2.0
// The client's end of its link: a worker's, where there is one, else one on this thread.
import type { Post, ToClient, ToLink } from "./channel.js";
import { describeFault } from "./errors.js";
import { workers } from "./workers.js";

/** The name of the worker's bundle, beside the page's: set by build.mjs. */
declare const ECORCHE_WORKER: string;

const LAST_WORDS_MS = 1000;

export interface Bridge {
  post: Post<ToLink>;
  /** The worker, if any, ends; what was posted before still leaves. */
  end(): void;
}

/** `worker`: worker.ts, bundled; false: no thread of its own. None: that of the page's own bundle, where it has one. */
export function makeBridge(worker: string | URL | false | undefined, hear: (message: ToClient) => void): Bridge {
  const url = worker ?? (typeof ECORCHE_WORKER === "undefined" ? false : new URL(ECORCHE_WORKER, import.meta.url));
  return url === false ? onThisThread(hear) : inWorker(url, hear);
}

function inWorker(url: string | URL, hear: (message: ToClient) => void): Bridge {
  const worker = workers.make(url);
  worker.onmessage = ({ data }: MessageEvent<ToClient>) => hear(data);
  worker.onmessageerror = () => hear({ kind: "failed", message: "a message of the worker cannot be read" });
  worker.onerror = (event) => {
    event.preventDefault();  // told by the client instead
    hear({ kind: "failed", message: event.message || `the worker ${url} does not start` });
  };
  return { post: (message, transfer = []) => worker.postMessage(message, transfer), end: () => void setTimeout(() => worker.terminate(), LAST_WORDS_MS) };
}

function onThisThread(hear: (message: ToClient) => void): Bridge {
  // A page with a worker has it there, and does not load it twice.
  const link = import("./make_link.js").then(({ makeLink }) => makeLink(hear));
  link.catch((error: unknown) => hear({ kind: "failed", message: describeFault(error) }));
  return { post: (message) => void link.then((made) => made.take(message)), end: () => {} };
}
