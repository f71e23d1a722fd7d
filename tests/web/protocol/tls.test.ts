// SPDX-License-Identifier: Apache-2.0
// A client before a server that shows a certificate: nobody's, another's, and one that is trusted.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import { WebSocket } from "ws";
import { Client, ConnectionError } from "../../../clients/web/protocol/src/index.js";
import { Server, within } from "../support/server.js";

/** Files of a certificate that is its own authority, for this machine. */
function certificate(folder: string, who: string): { certificate: string; key: string } {
  const [certificate, key] = ["pem", "key"].map((end) => path.join(folder, `${who}.${end}`)) as [string, string];
  const { status, stderr } = spawnSync("openssl", [
    "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", `/CN=${who}`, "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", certificate,
  ], { encoding: "utf8" });
  assert.equal(status, 0, stderr);
  return { certificate, key };
}

/** Node's WebSocket, as if started with NODE_EXTRA_CA_CERTS of this file. */
function trust(file: string): typeof globalThis.WebSocket {
  const ca = fs.readFileSync(file);
  return class extends WebSocket {
    constructor(url: string, protocols: string) {
      super(url, protocols, { ca });
    }
  } as unknown as typeof globalThis.WebSocket;
}

test("a foreign certificate is refused, and not asked again; a trusted one opens", async (t) => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-tls-")), own = certificate(folder, "own"), foreign = certificate(folder, "foreign");
  const plain = globalThis.WebSocket;
  t.after(() => {
    globalThis.WebSocket = plain;
    fs.rmSync(folder, { recursive: true });
  });
  const server = await Server.start(["--tls-certificate", own.certificate, "--tls-key", own.key]);
  t.after(() => server.stop());
  const secure = server.url.replace("ws:", "wss:");
  for (const [url, made, who] of [[secure, plain, "nobody's"], [secure, trust(foreign.certificate), "another's"], [server.url, plain, "without TLS"]] as const) {
    globalThis.WebSocket = made;
    const states: string[] = [];
    await assert.rejects(within(20, Client.connect(url, { onState: ({ state }) => states.push(state) }), who),
      (error: ConnectionError) => error instanceof ConnectionError && /^the connection ended \(1006\)$/.test(error.message), who);
    assert.deepEqual(states, ["connecting", "closed"], who);
  }
  globalThis.WebSocket = trust(own.certificate);
  const client = await within(20, Client.connect(secure), "who is trusted");
  t.after(() => client.close());
  assert.equal((await client.listModels()).length, 1);
});
