// SPDX-License-Identifier: Apache-2.0
// The library of `--pose lib:NAME`, which comes with its parser when the panel first wants it.
import library from "../../../../../io/case/data/poses.yaml";
import { presets, type Library, type Preset } from "./presets.js";
import type { Rig } from "./rig.js";

export async function givenPoses(rig: Rig): Promise<readonly Preset[]> {
  const { parse } = await import("yaml");
  return presets(parse(library) as Library, rig);
}
