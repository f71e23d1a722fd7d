// SPDX-License-Identifier: Apache-2.0
// One line of JSON for each size: best milliseconds of processor time a frame, of every way from bytes to vertices. Run by `run`.
import { makePlainKernel, type MakeKernel } from "../../clients/web/protocol/src/decode/kernel.js";
import { packNormals, STRIDE } from "../../clients/web/protocol/src/decode/packed.js";
import { loadWasmKernel } from "../../clients/web/protocol/src/decode/wasm_kernel.js";
import { Random, randomDeltas } from "../../tests/web/support/random.js";
import { triangleNormals } from "./triangle_normals.js";

const [seconds, ...sizes] = process.argv.slice(2).map(Number);
/** As a tissue of a walking body: 5 bits an axis. */
const TYPICAL = { digits: 4, widths: [5, 5, 5] as [number, number, number] };

/** What others take of the machine does not count. */
const spent = (): number => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
};

/** Best of as many runs as `seconds` hold, three at least. */
function best(run: () => void): number {
  let least = Infinity;
  const end = performance.now() + 1000 * seconds;
  for (let runs = 0; runs < 3 || performance.now() < end; ++runs) {
    const start = spent();
    run();
    least = Math.min(least, spent() - start);
  }
  return least;
}

/** A sheet: two triangles a vertex, as closed surfaces have. */
function sheet(vertices: number): Uint32Array {
  const wide = Math.floor(Math.sqrt(vertices)), high = Math.floor(vertices / wide), triangles: number[] = [];
  for (let row = 0; row + 1 < high; ++row) {
    for (let column = 0; column + 1 < wide; ++column) {
      const at = row * wide + column;
      triangles.push(at, at + 1, at + wide, at + 1, at + wide + 1, at + wide);
    }
  }
  return Uint32Array.from(triangles);
}

const wasm = (await loadWasmKernel())!;
for (const vertices of sizes) {
  const random = new Random(vertices), range = { tissue: 0, firstVertex: 0, vertexCount: vertices, firstIndex: 0, indexCount: 0 };
  const numbers = random.words(3 * vertices), normals = new Int8Array(random.words(vertices).buffer), deltas = randomDeltas(random, vertices, () => TYPICAL);
  const floats = Float32Array.from({ length: 3 * vertices }, () => random.below(2000) - 1000);
  const make = (kernel: MakeKernel) => {
    const made = kernel({ ranges: [range], vertexCount: vertices, slots: 1, deltas: true, shared: true });
    made.packNumbers(0, range, numbers, undefined, true);
    return made;
  };
  const ways = { plain: make(makePlainKernel), wasm: make(wasm) }, { slots: [out] } = ways.wasm, copy = new Uint16Array(out.length);
  const quantisation = { scale: 0.06, offset: [-1000, -1000, -1000] as [number, number, number] };
  const indices = sheet(vertices), work = new Float32Array(3 * vertices);
  console.log(JSON.stringify({
    vertices, bytes: deltas.length,
    copy: best(() => copy.set(out)),
    deltas_plain: best(() => ways.plain.decodeDeltas(0, range, deltas, undefined)),
    deltas_wasm: best(() => ways.wasm.decodeDeltas(0, range, deltas, undefined)),
    deltas_wasm_normals: best(() => ways.wasm.decodeDeltas(0, range, deltas, normals)),
    numbers_plain: best(() => ways.plain.packNumbers(0, range, numbers, undefined, false)),
    numbers_wasm: best(() => ways.wasm.packNumbers(0, range, numbers, undefined, false)),
    floats: best(() => ways.plain.packPositions(0, range, floats, quantisation, undefined)),
    normals_plain: best(() => packNormals(normals, out)),
    normals_triangles: best(() => triangleNormals(out, indices, work)),
    stride: STRIDE,
  }));
}
