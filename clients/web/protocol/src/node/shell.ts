// SPDX-License-Identifier: Apache-2.0
// A thread of node's as a worker of a page's: gives it what a page would, then runs the worker.
import { parentPort, workerData } from "node:worker_threads";
import { WebSocket } from "ws";

const port = parentPort!;
type Hear = (event: object) => void;

const scope = {
  postMessage: (message: unknown, transfer: ArrayBuffer[] = []): void => port.postMessage(message, transfer),
  addEventListener(kind: string, hear: Hear): void {
    if (kind === "message") port.on("message", (data: unknown) => hear({ data }));
    if (kind === "unhandledrejection") process.on("unhandledRejection", (reason) => hear({ reason }));
    if (kind === "error") process.on("uncaughtException", (error) => hear({ error, message: error.message }));
  },
};
Object.assign(globalThis, { self: scope });
globalThis.WebSocket ??= WebSocket as unknown as typeof globalThis.WebSocket;

await import(workerData as string);
