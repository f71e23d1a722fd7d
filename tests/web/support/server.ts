// SPDX-License-Identifier: Apache-2.0
// `ecorche serve` on free ports, for one test. ECORCHE_BIN and ECORCHE_MODEL say what is run and served.
import { spawn, type ChildProcess } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { WebSocket } from "ws";

// Older nodes have none; a browser's API.
globalThis.WebSocket = WebSocket as unknown as typeof globalThis.WebSocket;

const wait = (milliseconds: number) => new Promise((resolve) => setTimeout(resolve, milliseconds));

function needed(name: string): string {
  const value = process.env[name];
  if (!value) throw new Error(`${name} is not set (run by ctest, or say which file to use)`);
  return value;
}

export class Server {
  private constructor(private readonly child: ChildProcess, readonly port: number, readonly httpPort: number, readonly log: () => string) {}

  /** `options`: more words of `ecorche serve`. `port`, `httpPort`: 0: free ones. */
  static async start(options: string[] = [], { model = needed("ECORCHE_MODEL"), port = 0, httpPort = 0 } = {}): Promise<Server> {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-web-")), file = path.join(folder, "port");
    const child = spawn(needed("ECORCHE_BIN"), [
      "serve", model, "--listen", `127.0.0.1:${port}`, "--http", `127.0.0.1:${httpPort}`, "--port-file", file, ...options,
    ], { stdio: ["ignore", "ignore", "pipe"] });
    let log = "";
    child.stderr!.on("data", (bytes) => { log += bytes; });
    try {
      for (let tries = 0; !fs.existsSync(file); ++tries) {
        if (child.exitCode !== null || tries > 6000) throw new Error(`ecorche serve did not start: ${log}`);
        await wait(10);
      }
      const [tcp, http] = fs.readFileSync(file, "utf8").trim().split("\n").map(Number);
      return new Server(child, tcp, http, () => log);
    } finally {
      fs.rmSync(folder, { recursive: true, force: true });
    }
  }

  get url(): string {
    return `ws://127.0.0.1:${this.httpPort}/v1`;
  }

  async stop(signal: NodeJS.Signals = "SIGTERM"): Promise<void> {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    const ended = new Promise((resolve) => this.child.once("exit", resolve));
    this.child.kill(signal);
    await ended;
  }
}

/** Fails where `promise` takes longer: a test that hangs says nothing. */
export async function within<T>(seconds: number, promise: Promise<T>, what = "it"): Promise<T> {
  let timer: NodeJS.Timeout | undefined;
  const late = new Promise<never>((_, reject) => {
    timer = setTimeout(() => reject(new Error(`${what} took more than ${seconds} s`)), 1000 * seconds);
  });
  try {
    return await Promise.race([promise, late]);
  } finally {
    clearTimeout(timer);
  }
}
