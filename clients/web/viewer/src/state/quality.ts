// SPDX-License-Identifier: Apache-2.0
// The server's verdict on a pose as a person reads it: each figure beside its limit.
import { PoseQuality_Verdict, type PoseQuality } from "../../../protocol/src/index.js";
import type { Figure, Model, Quality } from "./app_state.js";
import { labelOf } from "./names.js";

const percent = (share: number) => `${(100 * share).toFixed(Math.abs(share) < 0.001 && share !== 0 ? 3 : 1)} %`;
const lowered = (name: string) => name.charAt(0).toLowerCase() + name.slice(1);
const millimetres = (value: number) => `${value.toFixed(2)} mm`;

export function qualityOf(quality: PoseQuality, model: Model | null): Quality {
  const figures: Figure[] = [
    figure("Turned inside out", quality.invertedShare, quality.maxInvertedShare, percent),
    figure("Change of volume", quality.unsignedVolumeChange, quality.maxVolumeChange, percent),
    figure("Bend of bones", quality.boneRigidity, quality.maxBoneRigidity, millimetres),
  ];
  const tissue = (row: number) => lowered(model?.tissues[row]?.label ?? `Tissue ${row}`);
  if (quality.overlap && quality.overlap.mm > quality.maxBoneOverlap)
    figures.push(figure(`Overlap of ${tissue(quality.overlap.bone)} with ${tissue(quality.overlap.into)}`, quality.overlap.mm, quality.maxBoneOverlap, millimetres));
  const changes = quality.tissues.filter((change) => change.share !== undefined && Math.abs(change.share) > change.maxShare);
  const worst = quality.tissues.find((change) => change.tissue === quality.worstTissue);
  for (const change of changes.length > 0 ? changes : worst ? [worst] : []) {
    figures.push(figure(`Volume of ${tissue(change.tissue)}`, Math.abs(change.share ?? 0), change.maxShare, percent));
  }
  for (const joint of quality.doubtful) {
    figures.push({
      name: `Joint ${labelOf(model?.joints[joint.joint] ?? String(joint.joint)).toLowerCase()} was found with little confidence`,
      value: percent(joint.confidence), limit: "50 %", over: true,
    });
  }
  return { verdict: quality.verdict === PoseQuality_Verdict.PASS ? "pass" : "warn", figures, poseSequence: quality.poseSequence };
}

function figure(name: string, value: number, limit: number, text: (value: number) => string): Figure {
  return { name, value: text(value), limit: text(limit), over: value > limit };
}
