// SPDX-License-Identifier: Apache-2.0
// How a client stands: with its connection, and in its session.
import type { Role } from "./gen/ecorche/v1/model_pb.js";

export type ConnectionState = "connecting" | "open" | "reconnecting" | "closed";

export interface StateChange {
  state: ConnectionState;
  /** One line for a person: why it is so; empty where all is well. */
  reason: string;
  /** Under "reconnecting": when the next try comes. */
  retryMs?: number;
}

export interface ControlState {
  role: Role;
  /** Free: claimControl would be granted. */
  vacant: boolean;
  /** Kept for its last holder so long; 0: not. */
  reservedSeconds: number;
}
