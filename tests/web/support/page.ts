// SPDX-License-Identifier: Apache-2.0
// The viewer in Chromium: its built files behind a server that has the headers of `ecorche serve` and hands /v1 on to a real one. A page
// that logs an error, breaks its policy or asks another host fails its test.
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import fs from "node:fs";
import http from "node:http";
import net from "node:net";
import os from "node:os";
import path from "node:path";

declare const ROOT: string;

export const VIEWER = process.env["ECORCHE_VIEWER"] ?? path.join(ROOT, "build/viewer");
const POLICY = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
  + "worker-src 'self'; frame-ancestors 'none'";
const TYPES: Record<string, string> = {
  ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
  ".txt": "text/plain; charset=utf-8", ".wasm": "application/wasm", ".json": "application/json",
};

/** Serves the built viewer, and hands WebSockets on to whatever port `backend` says at that time. */
export class Site {
  private constructor(private readonly server: http.Server, readonly origin: string) {}

  static async start(backend: () => number): Promise<Site> {
    const server = http.createServer((request, response) => {
      const name = new URL(request.url!, "http://site").pathname.replace(/^\/$/, "/index.html");
      const file = path.join(VIEWER, path.normalize(name));
      if (!fs.existsSync(file)) return void response.writeHead(404).end();
      response.writeHead(200, {
        "content-type": TYPES[path.extname(file)] ?? "application/octet-stream", "content-security-policy": POLICY,
        "cross-origin-opener-policy": "same-origin", "cross-origin-embedder-policy": "require-corp", "x-content-type-options": "nosniff",
      });
      fs.createReadStream(file).pipe(response);
    });
    const pipes = new Set<net.Socket>();
    server.on("upgrade", (request, socket: net.Socket, head) => {
      const upstream = net.connect(backend(), "127.0.0.1", () => {
        const headers = request.rawHeaders.flatMap((text, i, all) => (i % 2 === 0 && text.toLowerCase() !== "origin" ? [`${text}: ${all[i + 1]}`] : []));
        upstream.write(`${request.method} ${request.url} HTTP/1.1\r\n${headers.join("\r\n")}\r\n\r\n`);
        upstream.write(head);
        upstream.pipe(socket).pipe(upstream);
      });
      for (const [one, other] of [[upstream, socket], [socket, upstream]] as const) {
        pipes.add(one);
        one.on("error", () => other.destroy());
        one.on("close", () => { pipes.delete(one); other.destroy(); });
      }
    });
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    server.on("close", () => pipes.forEach((pipe) => pipe.destroy()));
    return new Site(server, `http://127.0.0.1:${(server.address() as net.AddressInfo).port}`);
  }

  stop(): void {
    this.server.close();
    this.server.closeAllConnections();
  }
}

export { launch } from "./chromium.js";

export interface Viewed {
  readonly page: Page;
  /** What went wrong in the page so far: errors of the console, of scripts, of its policy, and requests to other hosts. */
  readonly faults: string[];
  /** Names of the files that were fetched. */
  readonly files: Set<string>;
}

/** A page of the site, not yet loaded. Its small picture keeps software GL quick. */
export async function newPage(browser: Browser, site: Site, options: BrowserContextOptions = {}): Promise<Viewed> {
  const context = await browser.newContext({ viewport: { width: 900, height: 640 }, reducedMotion: "reduce", acceptDownloads: true, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const faults: string[] = [], files = new Set<string>();
  page.on("console", (message) => message.type() === "error" && faults.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => faults.push(`script: ${error.stack ?? error.message}`));
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (/^(https?|wss?):$/.test(url.protocol) && url.host !== new URL(site.origin).host) faults.push(`another host: ${url}`);
    if (url.origin === site.origin) files.add(url.pathname.replace(/^\/$/, "/index.html"));
  });
  page.on("websocket", (socket) => new URL(socket.url()).host !== new URL(site.origin).host && faults.push(`another host: ${socket.url()}`));
  await page.addInitScript(() => addEventListener("securitypolicyviolation", (event) =>
    console.error(`policy: ${event.violatedDirective} ${event.blockedURI}`)));
  return { page, faults, files };
}

/** Loads the page and waits for the first picture of the body. */
export async function openBody(page: Page, site: Site, hash = ""): Promise<void> {
  await page.goto(`${site.origin}/${hash}`);
  await page.waitForFunction(() => performance.getEntriesByName("ecorche body").length > 0, undefined, { timeout: 90_000 });
}

/** A folder that is gone when the process ends. */
export function scratch(): string {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-viewer-"));
  process.on("exit", () => fs.rmSync(folder, { recursive: true, force: true }));
  return folder;
}
