// SPDX-License-Identifier: Apache-2.0
// How things fail: by the server's Status, or by the loss of the connection. See also framing.ts, ProtocolError.
import type { Status } from "./gen/ecorche/v1/common_pb.js";

/** Of google.rpc.Code, what a client tells apart. */
export const Code = {
  INVALID_ARGUMENT: 3,
  NOT_FOUND: 5,
  ALREADY_EXISTS: 6,
  PERMISSION_DENIED: 7,
  RESOURCE_EXHAUSTED: 8,
  FAILED_PRECONDITION: 9,
  UNIMPLEMENTED: 12,
  UNAVAILABLE: 14,
  UNAUTHENTICATED: 16,
} as const;

/** A Status of the server that is not OK. */
export class ServerError extends Error {
  override name = "ServerError";
  readonly code: number;

  constructor(status: Status) {
    super(status.message);
    this.code = status.code;
  }
}

/** The connection ended before the answer came, or could not be made. */
export class ConnectionError extends Error {
  override name = "ConnectionError";
}

/** A server's hello, where it speaks what this client does; else throws ConnectionError. */
export function ofKnownProtocol<Hello extends { protocol: number }>(hello: Hello): Hello {
  if (hello.protocol !== 1) throw new ConnectionError(`the server speaks protocol ${hello.protocol}, this client 1`);
  return hello;
}

/** As an uncaught error, which the handlers of a page and of a test see. */
export function report(error: unknown): void {
  queueMicrotask(() => {
    throw error;
  });
}

export const describeFault = (error: unknown): string => (error instanceof Error ? (error.stack ?? error.message) : String(error));
