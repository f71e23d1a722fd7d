// SPDX-License-Identifier: Apache-2.0
// What a client skins by: read once, when it subscribes to motions. docs/reference/protocol.md, "Skinning at the client".
import { MeshoptDecoder } from "meshoptimizer/decoder";
import type { Quantisation } from "../decode/packed.js";
import { arrayOf, ProtocolError } from "../framing.js";
import { ScalarType } from "../gen/ecorche/v1/common_pb.js";
import type { SkinningData, TissueSkinning } from "../gen/ecorche/v1/stream_pb.js";
import type { MeshLayout } from "../layout.js";

/** Numbers of 16 bits for one point: x, y, z and the octahedral normal at rest, then x, y, z of its centre of rotation, and 0. */
export const POINT_NUMBERS = 8;
const POINT_BYTES = 16, INFLUENCE_BYTES = 4, HUNG_BYTES = 36, CORNERS = 4;

/** Points in one row: first the vertices of the layout, then the nodes that some of them hang on. */
export interface Skinning {
  /** Where the numbers of points stand. */
  box: Quantisation;
  segments: number;
  vertexCount: number;
  pointCount: number;
  /** POINT_NUMBERS a point. */
  points: Uint16Array<ArrayBuffer>;
  /** Of every point. */
  influences: number;
  /** A segment and a weight in 65535ths for each of them, the heaviest first. */
  weights: Uint16Array<ArrayBuffer>;
  /** Of a vertex: 0, or 1 + its row in hungNodes and hungShares, four each: it then goes with four points, and its own is not used. */
  hung: Uint32Array<ArrayBuffer>;
  hungNodes: Uint32Array<ArrayBuffer>;
  hungShares: Float32Array<ArrayBuffer>;
  /** mm and radians: how far off the server's vertices this is, over the poses `measured`. */
  largestError: number;
  usualNormalError: number;
  largestNormalError: number;
  measured: string[];
  /** Of the answer that brought it. */
  bytes: number;
}

function unpack(array: TissueSkinning["points"], payload: Uint8Array<ArrayBuffer>, count: number, stride: number): Uint8Array<ArrayBuffer> {
  const out = new Uint8Array(count * stride);
  if (count === 0) return out;
  const bytes = arrayOf(array, payload, ScalarType.U8, 1);
  try {
    MeshoptDecoder.decodeVertexBuffer(out, count, stride, bytes);
  } catch (error) {
    throw new ProtocolError(`skinning cannot be unpacked: ${error instanceof Error ? error.message : error}`);
  }
  return out;
}

/** `segments`: of the model. Wait for unpackingReady before. Throws ProtocolError for what does not fit the layout, or points beyond its own arrays. */
export function readSkinning(data: SkinningData, payload: Uint8Array<ArrayBuffer>, layout: MeshLayout, segments: number): Skinning {
  const { ranges, vertexCount } = layout, { tissues, box } = data;
  if (!box || !(box.step > 0) || ![box.step, box.lowX, box.lowY, box.lowZ].every(Number.isFinite)) throw new ProtocolError("skinning without its box");
  if (tissues.length !== ranges.length || tissues.some(({ tissue, vertices }, i) => tissue !== ranges[i].tissue || vertices !== ranges[i].vertexCount)) {
    throw new ProtocolError("skinning of other tissues than those of its frames");
  }
  let points = vertexCount, hungs = 0, influences = 1;
  for (const tissue of tissues) {
    // So that a few bytes that tell of many make no room: a hung vertex has four nodes at most.
    if (tissue.hungCount > tissue.vertices || tissue.pointCount < tissue.vertices || tissue.pointCount - tissue.vertices > CORNERS * tissue.hungCount
      || ![1, 4, 8].includes(tissue.influences)) throw new ProtocolError(`skinning of tissue ${tissue.tissue} that cannot be`);
    points += tissue.pointCount - tissue.vertices;
    hungs += tissue.hungCount;
    influences = Math.max(influences, tissue.influences);
  }
  const out: Skinning = {
    box: { scale: box.step, offset: [box.lowX, box.lowY, box.lowZ] }, segments, vertexCount, pointCount: points, influences,
    points: new Uint16Array(points * POINT_NUMBERS), weights: new Uint16Array(points * 2 * influences),
    hung: new Uint32Array(vertexCount), hungNodes: new Uint32Array(CORNERS * hungs), hungShares: new Float32Array(CORNERS * hungs),
    largestError: data.largestError, usualNormalError: data.usualNormalError, largestNormalError: data.largestNormalError,
    measured: data.measured, bytes: payload.length,
  };
  let node = vertexCount, hung = 0;
  tissues.forEach((tissue, i) => {
    const first = ranges[i].firstVertex, firstNode = node;
    const rowOf = (row: number): number => (row < tissue.vertices ? first + row : firstNode + row - tissue.vertices);
    readPoints(tissue, unpack(tissue.points, payload, tissue.pointCount, POINT_BYTES + INFLUENCE_BYTES * tissue.influences), rowOf, out);
    const rows = new DataView(unpack(tissue.hung, payload, tissue.hungCount, HUNG_BYTES).buffer);
    for (let h = 0; h < tissue.hungCount; ++h, ++hung) {
      const at = h * HUNG_BYTES, vertex = rows.getUint32(at, true);
      if (vertex >= tissue.vertices) throw new ProtocolError(`skinning hangs vertex ${vertex} of ${tissue.vertices}`);
      out.hung[first + vertex] = hung + 1;
      for (let c = 0; c < CORNERS; ++c) {
        const row = rows.getUint32(at + 4 + 4 * c, true), share = rows.getFloat32(at + 20 + 4 * c, true);
        if (row < tissue.vertices || row >= tissue.pointCount || !Number.isFinite(share)) throw new ProtocolError(`skinning hangs a vertex on row ${row} by ${share}`);
        out.hungNodes[CORNERS * hung + c] = rowOf(row);
        out.hungShares[CORNERS * hung + c] = share;
      }
    }
    node += tissue.pointCount - tissue.vertices;
  });
  return out;
}

function readPoints(tissue: TissueSkinning, bytes: Uint8Array<ArrayBuffer>, rowOf: (row: number) => number, out: Skinning): void {
  const rows = new Uint16Array(bytes.buffer), stride = POINT_NUMBERS + 2 * tissue.influences;
  for (let p = 0, from = 0; p < tissue.pointCount; ++p, from += stride) {
    const row = rowOf(p), to = row * POINT_NUMBERS;
    out.points.set(rows.subarray(from, from + POINT_NUMBERS), to);
    // As frames have it: packed.ts.
    const normal = rows[from + 3] ^ 0x8080;
    out.points[to + 3] = normal;
    let sum = 0;
    for (let k = 0; k < tissue.influences; ++k) {
      const segment = rows[from + POINT_NUMBERS + 2 * k], weight = rows[from + POINT_NUMBERS + 2 * k + 1];
      if (segment >= out.segments) throw new ProtocolError(`skinning by segment ${segment} of ${out.segments}`);
      out.weights[2 * (row * out.influences + k)] = segment;
      out.weights[2 * (row * out.influences + k) + 1] = weight;
      sum += weight;
    }
    // 0: of a vertex that hangs on others.
    if (sum !== 65535 && sum !== 0) throw new ProtocolError(`weights that sum to ${sum}`);
  }
}
