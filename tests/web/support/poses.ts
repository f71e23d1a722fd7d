// SPDX-License-Identifier: Apache-2.0
import type { ModelOpened, Pose } from "../../../clients/web/protocol/src/index.js";

/** Every joint turned a little about its first axis, by `angle` radians at most. */
export function bendingPose(model: ModelOpened, angle: number): Pose {
  const rotation = model.skeleton!.segments.flatMap((_, joint) => {
    const half = 0.5 * angle * Math.sin(joint + 1);
    return joint === 0 ? [1, 0, 0, 0] : [Math.cos(half), Math.sin(half), 0, 0];
  });
  return { rotation };
}
