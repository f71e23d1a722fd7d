// SPDX-License-Identifier: Apache-2.0
// Which Chromium tests start, and how.
import fs from "node:fs";
import { chromium, type Browser } from "playwright-core";

/**
 * WebGL is drawn by SwiftShader. The page around it is not: by the GPU's ways, done in software, it took a third of a test's processor time
 * (Debian's Chromium asks for them by itself).
 */
export const FLAGS = ["--no-sandbox", "--headless=new", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
  "--disable-gpu-rasterization", "--disable-gpu-compositing"];

/** ECORCHE_CHROMIUM, or the system's. */
export function executable(): string {
  const found = process.env["ECORCHE_CHROMIUM"] ?? ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find((file) => fs.existsSync(file));
  if (!found) throw new Error("no Chromium (run scripts/setup --tests)");
  return found;
}

export const launch = (): Promise<Browser> => chromium.launch({ executablePath: executable(), timeout: 60_000, args: FLAGS });
