// SPDX-License-Identifier: Apache-2.0
// Which surfaces of a case are drawn round voxels by ourselves.
#pragma once

#include <set>
#include <string>

#include <ecorche/values/case.hpp>

namespace ecorche::app {

/// Names of the entries that have a source yet: to be asked before `label_surfaces::resolve`.
inline std::set<std::string> drawn_surfaces(const Case& patient) {
  std::set<std::string> out;
  if (patient.skin_source) out.insert(patient.skin_name);
  for (const CaseBone& bone : patient.bones)
    if (bone.source) out.insert(bone.name);
  for (const CaseTissue& tissue : patient.tissues)
    if (tissue.source) out.insert(tissue.name);
  return out;
}

}  // namespace ecorche::app
