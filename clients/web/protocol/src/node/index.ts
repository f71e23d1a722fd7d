// SPDX-License-Identifier: Apache-2.0
// The library in node, where workers are threads and older versions have no WebSocket.
import { Worker as Thread } from "node:worker_threads";
import { WebSocket } from "ws";
import { workers, type WorkerLike } from "../workers.js";

export * from "../index.js";

// For clients without a worker, on this thread.
globalThis.WebSocket ??= WebSocket as unknown as typeof globalThis.WebSocket;

/** A worker's side of a page, of a thread; shell.ts is the other side. */
class NodeWorker implements WorkerLike {
  onmessage: WorkerLike["onmessage"] = null;
  onmessageerror: WorkerLike["onmessageerror"] = null;
  onerror: WorkerLike["onerror"] = null;
  private readonly thread: Thread;

  constructor(url: string | URL) {
    this.thread = new Thread(new URL("./shell.js", import.meta.url), { workerData: String(url) });
    const self = this as unknown as Worker;
    this.thread.on("message", (data: unknown) => this.onmessage?.call(self, { data } as MessageEvent));
    this.thread.on("messageerror", (data: unknown) => this.onmessageerror?.call(self, { data } as unknown as MessageEvent));
    this.thread.on("error", (error) => this.onerror?.call(self, { message: error.message, preventDefault() {} } as ErrorEvent));
  }

  postMessage(message: unknown, transfer: unknown = []): void {
    this.thread.postMessage(message, transfer as ArrayBuffer[]);
  }

  terminate(): void {
    void this.thread.terminate();
  }
}

workers.make = (url) => new NodeWorker(url);
