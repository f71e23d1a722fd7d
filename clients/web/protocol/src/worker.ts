// SPDX-License-Identifier: Apache-2.0
// The link in a thread of its own: pages start this file as a module worker. Whatever goes wrong here is told to the client, loudly.
import type { ToClient, ToLink } from "./channel.js";
import { describeFault } from "./errors.js";
import { makeLink } from "./make_link.js";

const scope = self as unknown as DedicatedWorkerGlobalScope;
const post = (message: ToClient, transfer: Transferable[] = []): void => scope.postMessage(message, transfer);
const fail = (error: unknown): void => post({ kind: "failed", message: describeFault(error) });

// A promise that nobody awaits fires no "error" at the page's Worker object.
scope.addEventListener("unhandledrejection", (event) => fail(event.reason));
scope.addEventListener("error", (event) => fail(event.error ?? event.message));

const link = makeLink(post);
scope.addEventListener("message", ({ data }: MessageEvent<ToLink>) => void link.then((made) => made.take(data)));
