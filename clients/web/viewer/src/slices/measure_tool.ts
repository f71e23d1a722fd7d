// SPDX-License-Identifier: Apache-2.0
// Clicks that measure: on the body, and on the planes, where a drag from one point to the next does as well.
import { Projector, plain } from "../posing/projector.js";
import { add, length, scale, subtract, type Vec3 } from "../posing/rotation.js";
import type { PointerTool, ScenePointer } from "../scene/tools.js";
import type { Stage } from "../scene/stage.js";
import type { PlaneTool } from "./board.js";
import type { MeasureKind } from "./measure.js";
import type { Measures } from "./measures.js";
import type { SliceTool } from "./state.js";

export type ChosenTool = () => SliceTool;

const kindOf = (tool: SliceTool): MeasureKind | null => (tool === "distance" || tool === "angle" ? tool : null);

// The surface that is drawn may stand out of the tets by the rounding of its numbers: a little below lies the body.
const BELOW = [0, 0.1, 0.25, 0.5, 1, 2];
const DRAG_PIXELS = 6;

export class BodyMeasureTool implements PointerTool {
  readonly #projector: Projector;

  constructor(private readonly stage: Stage, private readonly measures: Measures, private readonly chosen: ChosenTool) {
    this.#projector = new Projector(stage);
  }

  down(pointer: ScenePointer): boolean {
    const kind = kindOf(this.chosen());
    const picked = kind && pointer.pick();
    if (!kind || !picked) return false;
    const point = plain(picked.point), { along } = this.#projector.sight(pointer.ray);
    void this.measures.add(kind, BELOW.map((depth) => add(point, scale(along, depth))));
    return true;
  }

  move(): void {}

  up(): void {}

  cancel(): void {
    this.measures.cancel();
  }

  hover(pointer: ScenePointer): boolean {
    if (!kindOf(this.chosen())) return false;
    if (this.measures.store.state.draft) {
      const picked = pointer.pick();
      this.measures.point(picked && plain(picked.point));
      this.stage.invalidate();
    }
    return true;
  }
}

export function planeMeasureTool(measures: Measures, chosen: ChosenTool): PlaneTool {
  let from: Vec3 | null = null;
  return (point, phase, view) => {
    const kind = kindOf(chosen());
    if (!kind) return false;
    if (phase === "down") {
      from = point;
      void measures.add(kind, [point]);
    } else if (phase === "move") {
      measures.point(point);
    } else if (from && length(subtract(from, point)) > DRAG_PIXELS * view.mmPerPixel) {
      void measures.add(kind, [point]);
    }
    return true;
  };
}
