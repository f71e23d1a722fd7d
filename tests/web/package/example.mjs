// SPDX-License-Identifier: Apache-2.0
import { Client, STRIDE } from "ecorche-client";

const client = await Client.connect(process.argv[2] ?? "ws://127.0.0.1:7071/v1");    // 1. connect
const model = await client.open();                                                    // 2. open: the server's first model
const stream = await client.subscribeMesh({ tissues: ["skin"], normals: true });

const joints = model.skeleton.segments.map(({ joint }) => joint.name);
const rotation = joints.flatMap(() => [1, 0, 0, 0]);                                  // (w, x, y, z) for each; this is the scan
rotation.splice(4 * joints.indexOf("knee_right"), 2, Math.cos(0.5), Math.sin(0.5));
client.setPose({ rotation });                                                         // 3. pose: does not wait

const frame = await new Promise((resolve) => {
  stream.on("frame", (shown) => { if (shown.poseSequence > 0n) resolve(shown); });
});
const { vertices, scale, offset, layout } = frame;                                    // 4. draw: u16 x, y, z and normal
let lowest = Infinity;
for (let v = 0; v < layout.vertexCount; ++v) lowest = Math.min(lowest, offset[2] + scale * vertices[STRIDE * v + 2]);
console.log(`${layout.vertexCount} vertices, ${layout.indices.length / 3} triangles, lowest at z = ${lowest.toFixed(1)} mm`);
const { points, tissue } = await client.probe([0, 0, 1000], { toPosed: true, tissue: true });  // 5. probe
console.log(`now at ${Array.from(points, (x) => x.toFixed(1))} mm, in ${model.tissues[tissue[0]]?.name ?? "nothing"}`);
client.close();
