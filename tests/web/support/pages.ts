// SPDX-License-Identifier: Apache-2.0
// Pages for Chromium, served by node as the server would: cross-origin isolated, or not, under the viewer's policy.
import { build } from "esbuild";
import { spawn } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import type { AddressInfo } from "node:net";
import os from "node:os";
import path from "node:path";
import type { Page } from "playwright-core";
import { executable, FLAGS } from "./chromium.js";

declare const ROOT: string;
const web = () => path.join(ROOT, "clients/web");
const TYPES: Record<string, string> = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css" };
const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; connect-src 'self' ws://127.0.0.1:*";

/** Text by the path it is served under. */
export type Files = Record<string, string>;

/** Each entry (of clients/web or the tests) as a module of its name, `page.js` of `page.ts`. */
export async function bundle(entries: string[]): Promise<Files> {
  const { outputFiles } = await build({
    absWorkingDir: web(), entryPoints: entries, outdir: "/", entryNames: "[name]", bundle: true, format: "esm", target: "es2022", write: false,
    nodePaths: [path.join(web(), "node_modules")],
  });
  return Object.fromEntries(outputFiles.map(({ path: name, text }) => [`/${path.basename(name)}`, text]));
}

export interface Site {
  origin: string;
  close(): Promise<void>;
}

/** `posted`: what the page posts to its own origin. */
export async function serve(files: Files, { isolated = true, port = 0, posted = (_: string): void => {} } = {}): Promise<Site> {
  const server = http.createServer((request, response) => {
    if (request.method === "POST") {
      let body = "";
      request.on("data", (bytes) => { body += bytes; }).on("end", () => { response.writeHead(204).end(); posted(body); });
      return;
    }
    const { pathname } = new URL(request.url!, "http://127.0.0.1"), text = files[pathname];
    response.writeHead(text === undefined ? 404 : 200, {
      "Content-Type": TYPES[path.extname(pathname) || ".html"] ?? "text/plain", "Content-Security-Policy": POLICY, "X-Content-Type-Options": "nosniff",
      ...(isolated && { "Cross-Origin-Opener-Policy": "same-origin", "Cross-Origin-Embedder-Policy": "require-corp" }),
    });
    response.end(text ?? "");
  });
  await new Promise<void>((resolve) => server.listen(port, "127.0.0.1", resolve));
  return {
    origin: `http://127.0.0.1:${(server.address() as AddressInfo).port}`,
    close: () => new Promise((resolve) => { server.close(() => resolve()); server.closeAllConnections(); }),
  };
}

export { launch } from "./chromium.js";

/** Chromium without the debugging tap, which would look at every message of a WebSocket. Ends what it returns. */
export function openUntapped(url: string): () => Promise<void> {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-chromium-"));
  const child = spawn(executable(), [...FLAGS, `--user-data-dir=${profile}`, url], { detached: true, stdio: "ignore" });
  const ended = new Promise((resolve) => child.once("exit", resolve));
  return async () => {
    if (child.exitCode === null) process.kill(-child.pid!, "SIGKILL");
    await ended;
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
  };
}

/** What went wrong in the page: uncaught errors, and what the console says of errors (also of the page's policy). */
export function faultsOf(page: Page): string[] {
  const faults: string[] = [];
  page.on("pageerror", (error) => faults.push(error.message));
  page.on("console", (message) => { if (message.type() === "error") faults.push(message.text()); });
  return faults;
}
