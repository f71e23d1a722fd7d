// SPDX-License-Identifier: Apache-2.0
// Best milliseconds of the last frame of a file, of frames as a server writes them: ModelOpened, Subscribed, a keyframe, deltas. Run by `run`.
import { fromBinary } from "@bufbuild/protobuf";
import fs from "node:fs";
import { loadWasmKernel } from "../../clients/web/protocol/src/decode/wasm_kernel.js";
import { arrayOf, decodeFrame, type Frame } from "../../clients/web/protocol/src/framing.js";
import { ScalarType } from "../../clients/web/protocol/src/gen/ecorche/v1/common_pb.js";
import { EnvelopeSchema } from "../../clients/web/protocol/src/gen/ecorche/v1/envelope_pb.js";
import { MeshArray_Kind, type MeshFrame } from "../../clients/web/protocol/src/gen/ecorche/v1/stream_pb.js";
import { wholeLayout, wholeTissues } from "../../clients/web/protocol/src/layout.js";

const bytes = fs.readFileSync(process.argv[2]), frames: Frame[] = [];
for (let at = 0; at < bytes.length;) {
  const size = Math.ceil((8 + bytes.readUInt32LE(at)) / 16) * 16 + bytes.readUInt32LE(at + 4);
  frames.push(decodeFrame(Uint8Array.from(bytes.subarray(at, at + size)).buffer));
  at += size;
}
const read = ({ envelope }: Frame) => fromBinary(EnvelopeSchema, envelope).message;
const opened = read(frames[0]);
if (opened.case !== "modelOpened") throw new Error("no model");
const { ranges, vertexCount } = wholeLayout(wholeTissues(opened.value, frames[0].payload), []);
const kernel = (await loadWasmKernel())!({ ranges, vertexCount, slots: 1, deltas: true, shared: true });

function decode(frame: Frame, key: boolean): void {
  const { arrays } = read(frame).value as MeshFrame;
  for (let i = 0; i < arrays.length; i += 2) {
    if (arrays[i].kind !== MeshArray_Kind.POSITIONS || arrays[i + 1].kind !== MeshArray_Kind.NORMALS) throw new Error("other arrays");
    const normals = arrayOf(arrays[i + 1].array, frame.payload, ScalarType.I8, 2), range = ranges[i / 2];
    if (key) kernel.packNumbers(0, range, arrayOf(arrays[i].array, frame.payload, ScalarType.U16, 3), normals, true);
    else kernel.decodeDeltas(0, range, arrayOf(arrays[i].array, frame.payload, ScalarType.U8, 1), normals);
  }
}

decode(frames[2], true);
let best = Infinity;
for (let run = 0; run < 200; ++run) {
  const start = performance.now();
  decode(frames[3], false);
  best = Math.min(best, performance.now() - start);
}
console.log(best);
