// SPDX-License-Identifier: Apache-2.0
// Runs tests in TypeScript: bundles each to where it finds the packages of clients/web, then `node --test`.
//
//     node tests/web/run.mjs protocol/client.test.ts ...     of the viewer: builds it first, for these tests alone
//     node tests/web/run.mjs --types                         checks the types of all tests instead
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url)), root = path.resolve(here, "../.."), web = path.join(root, "clients/web");
const prepared = spawnSync(path.join(root, "scripts/viewer"), ["--protocol"], { stdio: "inherit" });
if (prepared.status !== 0) process.exit(prepared.status ?? 70);

if (process.argv[2] === "--types") {
  process.exit(spawnSync(path.join(web, "node_modules/.bin/tsc"), ["-p", here], { stdio: "inherit" }).status ?? 70);
}
const { build } = await import(path.join(web, "node_modules/esbuild/lib/main.js"));
const out = fs.mkdtempSync(path.join(web, "node_modules/.tests-"));
process.on("exit", () => fs.rmSync(out, { recursive: true, force: true }));
await build({
  absWorkingDir: here, entryPoints: process.argv.slice(2), outdir: out, outExtension: { ".js": ".mjs" }, outbase: here,
  bundle: true, platform: "node", format: "esm", target: "node18", external: ["ws", "playwright-core", "axe-core", "esbuild", "yaml"], sourcemap: "inline",
  nodePaths: [path.join(web, "node_modules")], loader: { ".yaml": "text", ".glsl": "text" }, define: { ROOT: JSON.stringify(root) },
});
const env = { ...process.env };
// A folder of its own: tests beside this one may build, too. ECORCHE_VIEWER names one that is built.
if (!env.ECORCHE_VIEWER && process.argv.slice(2).some((file) => fs.readFileSync(path.join(here, file), "utf8").includes("support/page.js"))) {
  env.ECORCHE_VIEWER = path.join(out, "site");
  const { status } = spawnSync(path.join(root, "scripts/viewer"), ["--out", env.ECORCHE_VIEWER], { stdio: ["ignore", "ignore", "inherit"], env: process.env });
  if (status !== 0) process.exit(status ?? 70);
}
// That takes as long as it is told to.
const slow = process.argv.includes("viewer/heap.test.ts");
const files = process.argv.slice(2).map((file) => path.join(out, file.replace(/\.ts$/, ".mjs")));
const { status } = spawnSync(process.execPath, ["--enable-source-maps", "--test", ...files], { stdio: "inherit", timeout: slow ? 1_180_000 : 580_000, env });
process.exit(status ?? 70);
