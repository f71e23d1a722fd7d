// SPDX-License-Identifier: Apache-2.0
// How far the posed body is from the scanned one, for the legend; each pixel's own is made by the shader (body_shader.ts).
import { STRIDE, type Positions, type TissueRange } from "./body.js";

/** mm; of every vertex of at most `sample` a tissue, drawn evenly. */
export function farthestFromRest(posed: Positions, rest: Positions, ranges: readonly TissueRange[], sample = 4096): number {
  let most = 0;
  for (const { firstVertex, vertexCount } of ranges) {
    const every = Math.max(1, Math.floor(vertexCount / sample));
    for (let vertex = firstVertex; vertex < firstVertex + vertexCount; vertex += every) {
      let square = 0;
      for (let axis = 0; axis < 3; axis++) {
        const at = vertex * STRIDE + axis;
        const moved = posed.numbers[at]! * posed.step + posed.low[axis]! - rest.numbers[at]! * rest.step - rest.low[axis]!;
        square += moved * moved;
      }
      if (square > most) most = square;
    }
  }
  return Math.sqrt(most);
}

/** The end of a scale that holds `most`: 1, 2 or 5 times a power of ten, at least 10 mm. */
export function niceRange(most: number): number {
  if (!(most > 10)) return 10;
  const power = 10 ** Math.floor(Math.log10(most));
  return ([1, 2, 5].find((times) => times * power >= most) ?? 10) * power;
}
