// SPDX-License-Identifier: Apache-2.0
// What whole tissues have, the scanned body, numbers of vertices or caps, in the order of another layout's vertices.
import { STRIDE, type BodyFrame, type MeshLayout, type ModelOpened } from "../../protocol/src/index.js";

/** `whole` holds every tissue with all of its vertices; of those come the ones that `layout` has. */
export function restNumbers(whole: Pick<BodyFrame, "vertices" | "layout">, layout: MeshLayout): Uint16Array {
  const numbers = new Uint16Array(layout.vertexCount * STRIDE);
  for (const range of layout.ranges) {
    const from = whole.layout.ranges.find(({ tissue }) => tissue === range.tissue);
    if (!from) throw new Error(`tissue ${range.tissue} is missing in the scanned body`);
    for (let vertex = 0; vertex < range.vertexCount; vertex++) {
      const row = (range.rows ? range.rows[vertex]! : vertex) + from.firstVertex;
      numbers.set(whole.vertices.subarray(row * STRIDE, (row + 1) * STRIDE), (range.firstVertex + vertex) * STRIDE);
    }
  }
  return numbers;
}

/** A number for each vertex of `layout`, of those of whole tissues. */
export function valuesOf(whole: ReadonlyMap<number, Float32Array>, layout: MeshLayout): Float32Array {
  const values = new Float32Array(layout.vertexCount);
  for (const { tissue, firstVertex, vertexCount, rows } of layout.ranges) {
    const from = whole.get(tissue);
    if (!from) throw new Error(`tissue ${tissue} is missing among the numbers of the vertices`);
    for (let vertex = 0; vertex < vertexCount; vertex++) values[firstVertex + vertex] = from[rows ? rows[vertex]! : vertex]!;
  }
  return values;
}

/** 255 for each vertex of `layout` that is a cap's, where the border of the scan cuts the body; null where nothing is cut. */
export function capsOf(tissues: readonly Pick<ModelOpened["tissues"][number], "capVertices">[], layout: MeshLayout): Uint8Array | null {
  if (tissues.every(({ capVertices }) => capVertices.length === 0)) return null;
  const caps = new Uint8Array(layout.vertexCount);
  for (const { tissue, firstVertex, vertexCount, rows } of layout.ranges) {
    const bits = tissues[tissue]?.capVertices;
    if (!bits?.length) continue;
    for (let vertex = 0; vertex < vertexCount; vertex++) {
      const row = rows ? rows[vertex]! : vertex;
      if (((bits[row >> 3] ?? 0) >> (row & 7)) & 1) caps[firstVertex + vertex] = 255;
    }
  }
  return caps;
}
