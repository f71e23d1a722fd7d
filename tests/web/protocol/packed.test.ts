// SPDX-License-Identifier: Apache-2.0
// The shader of a vertex of 8 bytes in Chromium (software GL), beside the C library's floats of the same frame; and every normal that there is.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { faultsOf, launch, serve, type Site } from "../support/pages.js";
import { Server } from "../support/server.js";

declare const ROOT: string;
let browser: Browser, site: Site, page: Page, faults: string[];

before(async () => {
  [browser, site] = await Promise.all([launch(), serve({ "/": "<!doctype html>" })]);
  page = await browser.newPage();
  faults = faultsOf(page);
  await page.goto(site.origin);
});
after(async () => {
  await browser?.close();
  await site?.close();
});

/** Six floats a vertex, by the shader. */
async function unpacked(vertices: Uint16Array, low: number[], step: number): Promise<number[]> {
  const source = fs.readFileSync(path.join(ROOT, "clients/shaders/packed.glsl"), "utf8");
  const made = await page.evaluate(({ source, numbers, low, step }) => {
    const gl = document.createElement("canvas").getContext("webgl2")!, program = gl.createProgram()!, count = numbers.length / 4;
    for (const [kind, text] of [[gl.VERTEX_SHADER, source], [gl.FRAGMENT_SHADER, "void main() {}\n"]] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, `#version 300 es\n${text}`);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.transformFeedbackVaryings(program, ["position", "normal"], gl.INTERLEAVED_ATTRIBS);
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getAttachedShaders(program)!.map((each) => gl.getShaderInfoLog(each)).join(""));
    gl.useProgram(program);
    gl.uniform3fv(gl.getUniformLocation(program, "low"), low);
    gl.uniform1f(gl.getUniformLocation(program, "numberStep"), step);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, Uint16Array.from(numbers), gl.STATIC_DRAW);
    const at = gl.getAttribLocation(program, "numbers");
    gl.enableVertexAttribArray(at);
    gl.vertexAttribIPointer(at, 4, gl.UNSIGNED_SHORT, 8, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    const out = gl.createBuffer();
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, out);
    gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, 24 * count, gl.STREAM_READ);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, count);
    gl.endTransformFeedback();
    const floats = new Float32Array(6 * count);
    gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, floats);
    return Array.from(floats);
  }, { source, numbers: Array.from(vertices), low, step });
  assert.deepEqual(faults, []);
  return made;
}

test("positions and normals are those of the C library", async (t) => {
  const server = await Server.start(), folder = fs.mkdtempSync(path.join(os.tmpdir(), "ecorche-packed-"));
  t.after(async () => {
    fs.rmSync(folder, { recursive: true });
    await server.stop();
  });
  const { status, stdout, stderr } = spawnSync("/usr/bin/python3", [
    path.join(ROOT, "tests/web/protocol/packed_reference.py"), ROOT, `127.0.0.1:${server.port}`, "skin", folder,
  ], { encoding: "utf8" });
  assert.equal(status, 0, stderr);
  const { low, step } = JSON.parse(stdout) as { low: number[]; step: number };
  const bytes = (name: string) => Uint8Array.from(fs.readFileSync(path.join(folder, name))).buffer;
  const vertices = new Uint16Array(bytes("vertices")), positions = new Float32Array(bytes("positions")), normals = new Float32Array(bytes("normals"));
  const made = await unpacked(vertices, low, step);
  assert.equal(made.length, 2 * positions.length);
  let apart = 0, turned = 0, none = 0;
  for (let v = 0; v < positions.length / 3; ++v) {
    if (vertices[4 * v + 3] === 0) ++none;
    for (let c = 0; c < 3; ++c) {
      apart = Math.max(apart, Math.abs(made[6 * v + c]! - positions[3 * v + c]!));
      turned = Math.max(turned, Math.abs(made[6 * v + 3 + c]! - normals[3 * v + c]!));
    }
  }
  assert.ok(positions.length > 3000 && none < positions.length / 6, "a body with normals");
  // Float32's grain at 2 m, since the shader has no doubles; the step between numbers is 0.06 mm.
  console.log(`within ${apart} mm and ${turned} of the C library`);
  assert.ok(apart <= 2.5e-4, `${apart} mm apart`);
  assert.ok(turned <= 1e-6, `normals ${turned} apart`);
});

test("every normal is the octahedral map's", async () => {
  const vertices = new Uint16Array(4 * 65536);
  for (let code = 0; code < 65536; ++code) vertices[4 * code + 3] = code;
  const made = await unpacked(vertices, [1, 2, 3], 0.5);
  for (let code = 0; code < 65536; ++code) {
    assert.deepEqual(made.slice(6 * code, 6 * code + 3), [1, 2, 3]);
    const u = (code & 255) - 128, v = (code >> 8) - 128, z = 127 - Math.abs(u) - Math.abs(v);
    const n = code === 0 ? [0, 0, 0] : z < 0 ? [(127 - Math.abs(v)) * (u < 0 ? -1 : 1), (127 - Math.abs(u)) * (v < 0 ? -1 : 1), z] : [u, v, z];
    const length = Math.hypot(...n) || 1;
    for (let c = 0; c < 3; ++c) {
      const off = Math.abs(made[6 * code + 3 + c]! - n[c]! / length);
      assert.ok(off <= 2e-7, `code ${code}, axis ${c}: ${off} apart`);
    }
  }
});
