// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ecorche/values/model.hpp>
#include "io/surface/surface_file.hpp"

namespace ecorche::app {

/// The tets of a model by what they lie in: `soft`, or a bone under its name.
inline io::TetRegions tet_regions(const Model& model) {
  io::TetRegions regions{model.tet_label, {"soft"}};
  regions.names.insert(regions.names.end(), model.bone_names.begin(), model.bone_names.end());
  return regions;
}

}  // namespace ecorche::app
