// SPDX-License-Identifier: Apache-2.0
// A request whose failure is a line for the person who asked.
import type { Client } from "../../../protocol/src/index.js";
import { wordsOf } from "../errors.js";

export async function askServer(client: Client | null, say: (text: string) => void, run: (client: Client) => Promise<void>): Promise<void> {
  if (!client) return say("Not connected");
  try {
    await run(client);
  } catch (error) {
    say(wordsOf(error));
  }
}
