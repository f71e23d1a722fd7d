// SPDX-License-Identifier: Apache-2.0
// The scanned body in the order of another layout's vertices.
import { STRIDE, type BodyFrame, type MeshLayout } from "../../protocol/src/index.js";

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
