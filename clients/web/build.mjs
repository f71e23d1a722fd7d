// SPDX-License-Identifier: Apache-2.0
// Bundles viewer/index.html with what it names, and the workers of the protocol, into OUT: hashed names, everything gzipped beside, and
// the licences of what went in. Run by scripts/viewer.
//
//     node build.mjs OUT
import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import zlib from "node:zlib";
import { fileURLToPath } from "node:url";

const here = path.dirname(fileURLToPath(import.meta.url));
const out = path.resolve(process.argv[2]);
const page = path.join(here, "viewer/index.html");

/** @param {string[]} entryPoints @param {Record<string, string>} define */
async function bundle(entryPoints, define) {
  const { metafile } = await build({
    absWorkingDir: here, entryPoints, define, outdir: out, entryNames: "[name]-[hash]", assetNames: "[name]-[hash]",
    bundle: true, splitting: true, chunkNames: "[name]-[hash]", minify: true, format: "esm", target: "es2022", metafile: true, legalComments: "none", logLevel: "warning",
    loader: { ".svg": "file", ".png": "file", ".woff2": "file", ".yaml": "text", ".glsl": "text" },
  });
  const outputs = Object.entries(metafile.outputs);
  const nameOf = (entry) => path.basename(outputs.find(([, output]) => output.entryPoint === entry)[0]);
  return { inputs: Object.keys(metafile.inputs), names: new Map(entryPoints.map((entry) => [entry, nameOf(entry)])) };
}

/** Name, version and licence of every package that a file of `inputs` belongs to, with the text. */
function licences(inputs) {
  const folders = new Set(inputs.map((file) => file.match(/^node_modules\/(?:@[^/]+\/)?[^/]+/)?.[0]).filter(Boolean));
  return [...folders].sort().map((folder) => {
    const { name, version, license } = JSON.parse(fs.readFileSync(path.join(here, folder, "package.json"), "utf8"));
    const file = fs.readdirSync(path.join(here, folder)).find((entry) => /^(licen[cs]e|copying)/i.test(entry));
    const text = file ? fs.readFileSync(path.join(here, folder, file), "utf8").trim() : "";
    return `${name} ${version}, ${license}\n\n${text}\n`;
  }).join(`\n${"-".repeat(80)}\n\n`);
}

function fail(message) {
  console.error(`error: viewer: ${message}`);
  process.exit(65);
}

if (!fs.existsSync(page)) fail("clients/web/viewer/index.html is missing");
fs.rmSync(out, { recursive: true, force: true });
fs.mkdirSync(out, { recursive: true });

const WORKERS = { ECORCHE_WORKER: "protocol/src/worker.ts", ECORCHE_VOLUME_WORKER: "protocol/src/volume/worker.ts" };
const workers = await bundle(Object.values(WORKERS), {});
const workerNames = Object.fromEntries(Object.entries(WORKERS).map(([define, entry]) => [define, JSON.stringify(workers.names.get(entry))]));

// The page names its sources (`src="src/main.ts"`, `href="src/style.css"`): each becomes a bundle, whose name takes the source's place.
let html = fs.readFileSync(page, "utf8");
const sources = [...html.matchAll(/(?:src|href)="((?!\w+:)[^"#?]+\.(?:ts|css))"/g)].map(([, source]) => path.posix.join("viewer", source));
if (sources.length === 0) fail("clients/web/viewer/index.html names no source");
const viewer = await bundle([...new Set(sources)], workerNames);
for (const [source, name] of viewer.names) html = html.replaceAll(`"${path.posix.relative("viewer", source)}"`, `"${name}"`);
fs.writeFileSync(path.join(out, "index.html"), html);
fs.writeFileSync(path.join(out, "licences.txt"), licences([...viewer.inputs, ...workers.inputs]));

/** Zopfli finds gzip files that are a twentieth smaller; where it is not installed, zlib's will do. */
function gzipped(file, bytes) {
  const { status, stdout } = spawnSync("zopfli", ["-c", file], { maxBuffer: 1 << 28 });
  return status === 0 ? stdout : zlib.gzipSync(bytes, { level: 9 });
}

let total = 0;
for (const name of fs.readdirSync(out).sort()) {
  const bytes = fs.readFileSync(path.join(out, name)), packed = gzipped(path.join(out, name), bytes);
  fs.writeFileSync(path.join(out, `${name}.gz`), packed);
  total += packed.length;
  console.log(`${(bytes.length / 1000).toFixed(1).padStart(8)} kB ${(packed.length / 1000).toFixed(1).padStart(8)} kB gzipped  ${name}`);
}
console.log(`${(total / 1000).toFixed(1).padStart(20)} kB gzipped in all`);
