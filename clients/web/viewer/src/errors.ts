// SPDX-License-Identifier: Apache-2.0
// What went wrong, in a line for a person.
import { ServerError } from "../../protocol/src/index.js";

export function wordsOf(error: unknown): string {
  if (error instanceof ServerError) return `The server refuses: ${error.message}`;
  return error instanceof Error ? error.message : String(error);
}
