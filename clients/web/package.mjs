// SPDX-License-Identifier: Apache-2.0
// Makes the folder that `npm pack` packs: the library of protocol/ in plain JavaScript, its types, its workers as bundles. Run by scripts/viewer.
//
//     node package.mjs OUT
import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url)), source = path.join(here, "protocol");
const out = path.resolve(process.argv[2]), dist = path.join(out, "dist");

function fail(message) {
  console.error(`error: viewer: ${message}`);
  process.exit(65);
}

const manifest = JSON.parse(fs.readFileSync(path.join(source, "package.json"), "utf8"));
const { dependencies, devDependencies } = JSON.parse(fs.readFileSync(path.join(here, "package.json"), "utf8"));
for (const [name, version] of Object.entries(manifest.dependencies)) {
  const tested = dependencies[name] ?? devDependencies[name];
  if (tested !== version) fail(`protocol/package.json wants ${name} ${version}, which was tested with ${tested}`);
}

fs.rmSync(out, { recursive: true, force: true });
fs.mkdirSync(dist, { recursive: true });

const common = {
  absWorkingDir: here, outdir: dist, bundle: true, format: "esm", target: "es2022", legalComments: "none", logLevel: "warning", loader: { ".glsl": "text" },
  define: { ECORCHE_WORKER: '"./worker.js"', ECORCHE_VOLUME_WORKER: '"./volume_worker.js"' },
};
// What others bundle or import, with its packages left to npm; and workers, which nobody bundles.
await build({ ...common, entryPoints: { index: "protocol/src/index.ts", skinning: "protocol/src/skinning/gpu.ts" }, packages: "external", splitting: true });
await build({ ...common, entryPoints: { node: "protocol/src/node/index.ts", shell: "protocol/src/node/shell.ts" }, packages: "external", platform: "node" });
await build({ ...common, entryPoints: { worker: "protocol/src/worker.ts", volume_worker: "protocol/src/volume/worker.ts" }, minify: true });

const types = spawnSync(path.join(here, "node_modules/.bin/tsc"), [
  "-p", source, "--noEmit", "false", "--declaration", "--emitDeclarationOnly", "--outDir", path.join(dist, "types"), "--rootDir", path.join(source, "src"),
], { stdio: "inherit" });
if (types.status !== 0) fail("tsc failed");
for (const name of ["package.json", "README.md"]) fs.copyFileSync(path.join(source, name), path.join(out, name));
fs.copyFileSync(path.join(here, "../../LICENSES/Apache-2.0.txt"), path.join(out, "LICENSE"));
