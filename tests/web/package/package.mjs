// SPDX-License-Identifier: Apache-2.0
// The npm package as its users have it: packed, installed into an empty project, offline, and used there in node and by a bundler.
//
//     node tests/web/package/package.mjs
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url)), root = path.resolve(here, "../../.."), web = path.join(root, "clients/web");
const folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-package-"));
process.on("exit", () => fs.rmSync(folder, { recursive: true, force: true }));

function run(words, { cwd = folder, fails = false } = {}) {
  const { status, stdout, stderr } = spawnSync(words[0], words.slice(1), { cwd, encoding: "utf8", timeout: 120_000 });
  assert.equal(status !== 0, fails, `${words.join(" ")} ended with ${status}:\n${stdout}${stderr}`);
  return stdout + stderr;
}

// Packed: everything that is meant to be in it, and nothing else.
run([path.join(root, "scripts/viewer"), "--package", path.join(folder, "made")]);
const [packed] = JSON.parse(run(["npm", "pack", "--json", "--pack-destination", folder], { cwd: path.join(folder, "made") }).match(/^\[[^]*^\]/m)[0]);
const files = packed.files.map((file) => file.path);
for (const file of ["package.json", "README.md", "LICENSE", "dist/index.js", "dist/node.js", "dist/shell.js", "dist/worker.js", "dist/volume_worker.js",
  "dist/skinning.js", "dist/types/index.d.ts", "dist/types/gen/ecorche/v1/stream_pb.d.ts", "dist/types/skinning/gpu.d.ts"]) {
  assert(files.includes(file), `${file} is not packed: ${files}`);
}
assert(files.every((file) => /^(dist\/.*\.(js|d\.ts)|package\.json|README\.md|LICENSE)$/.test(file)), `what else is packed: ${files}`);
assert(!fs.readFileSync(path.join(folder, "made/dist/index.js"), "utf8").includes("node:"), "a page's bundle asks for node");

// Installed: from its tarball and those of its dependencies, as the lockfile has them.
const project = path.join(folder, "project");
fs.mkdirSync(project);
fs.writeFileSync(path.join(project, "package.json"), '{ "private": true, "type": "module" }\n');
const manifest = JSON.parse(fs.readFileSync(path.join(folder, "made/package.json"), "utf8"));
const locked = JSON.parse(fs.readFileSync(path.join(web, "package-lock.json"), "utf8")).packages;
const tarballs = Object.entries(manifest.dependencies).map(([name, version]) => {
  assert.equal(locked[`node_modules/${name}`].version, version, name);
  const [one] = JSON.parse(run(["npm", "pack", "--json", "--ignore-scripts", "--pack-destination", folder, path.join(web, "node_modules", name)]).match(/^\[[^]*^\]/m)[0]);
  return path.join(folder, one.filename);
});
run(["npm", "install", "--offline", "--no-audit", "--no-fund", path.join(folder, packed.filename), ...tarballs], { cwd: project });
const installed = fs.readdirSync(path.join(project, "node_modules")).filter((name) => !name.startsWith(".")).sort();
assert.deepEqual(installed, ["@bufbuild", "ecorche-client", "fzstd", "meshoptimizer", "ws"]);

// Typed: by both ways that TypeScript finds packages.
for (const file of ["example.mjs", "typed.ts"]) fs.copyFileSync(path.join(here, file), path.join(project, file));
for (const [module, resolution] of [["NodeNext", "NodeNext"], ["ESNext", "Bundler"]]) {
  run([path.join(web, "node_modules/.bin/tsc"), "--noEmit", "--strict", "--skipLibCheck", "--target", "ES2022", "--lib", "ES2022,DOM,DOM.Iterable",
    "--module", module, "--moduleResolution", resolution, "typed.ts"], { cwd: project });
}
const bundle = run([path.join(web, "node_modules/.bin/esbuild"), "example.mjs", "--bundle", "--format=esm", "--platform=browser", "--log-level=error"], { cwd: project });
assert(bundle.includes("worker.js") && !bundle.includes("worker_threads"), "a page's bundle");

// Used: the example of the README's length, decoded in a thread; without the thread's file it says so.
const { ECORCHE_BIN, ECORCHE_MODEL } = process.env;
const port = path.join(folder, "port");
const server = spawn(ECORCHE_BIN, ["serve", ECORCHE_MODEL, "--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", "--port-file", port], { stdio: "ignore" });
try {
  while (!fs.existsSync(port)) {
    assert.equal(server.exitCode, null, "ecorche serve did not start");
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  const url = `ws://127.0.0.1:${fs.readFileSync(port, "utf8").trim().split("\n")[1]}/v1`;
  const lines = fs.readFileSync(path.join(here, "example.mjs"), "utf8").split("\n").filter((line) => line && !line.startsWith("//"));
  assert(lines.length <= 20, `the example has ${lines.length} lines`);
  assert.match(run(["node", "example.mjs", url], { cwd: project }),
    /^\d+ vertices, \d+ triangles, lowest at z = -?\d+\.\d mm\nnow at -?[\d.]+,-?[\d.]+,-?[\d.]+ mm, in \w+\n$/);
  fs.rmSync(path.join(project, "node_modules/ecorche-client/dist/worker.js"));
  assert.match(run(["node", "example.mjs", url], { cwd: project, fails: true }), /worker\.js/);
  fs.writeFileSync(path.join(project, "inline.mjs"), fs.readFileSync(path.join(here, "example.mjs"), "utf8").replace('/v1")', '/v1", { worker: false })'));
  assert.match(run(["node", "inline.mjs", url], { cwd: project }), /vertices/);
} finally {
  server.kill();
}
console.log(`${packed.filename}: ${files.length} files, ${(packed.size / 1000).toFixed(0)} kB`);
