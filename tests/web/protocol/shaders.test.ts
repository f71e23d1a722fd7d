// SPDX-License-Identifier: Apache-2.0
// The shaders of clients/shaders, by every method and number of influences, through the reference compiler. What they compute is held in
// viewer/arrival.test.ts and packed.test.ts (GLSL), in software GL.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";

declare const ROOT: string;
const COMPILER = "glslangValidator";
const missing = spawnSync(COMPILER, ["--version"]).error !== undefined && "no glslangValidator (apt install glslang-tools)";

for (const name of ["skinning.glsl", "skinning.hlsl", "packed.glsl", "packed.hlsl"]) {
  test(name, { skip: missing }, () => {
    const text = fs.readFileSync(path.join(ROOT, "clients/shaders", name), "utf8"), folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-shaders-"));
    try {
      const skins = name.startsWith("skinning");
      for (const method of skins ? [1, 2, 3] : [1]) {
        for (const influences of skins ? [1, 4, 8] : [1]) {
          const defines = `#define METHOD ${method}\n#define INFLUENCES ${influences}\n`, hlsl = name.endsWith(".hlsl");
          const file = path.join(folder, hlsl ? "skinning.comp" : "skinning.vert");
          fs.writeFileSync(file, hlsl ? defines + text : `#version 300 es\n${defines}${text}`);
          const { status, stdout } = spawnSync(COMPILER, hlsl ? ["-D", "-V", "-e", "main", "-o", path.join(folder, "out.spv"), file] : [file], { encoding: "utf8" });
          assert.equal(status, 0, `method ${method}, ${influences} influences: ${stdout}`);
        }
      }
    } finally {
      fs.rmSync(folder, { recursive: true, force: true });
    }
  });
}
