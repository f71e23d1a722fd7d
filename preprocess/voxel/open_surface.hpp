// SPDX-License-Identifier: Apache-2.0
// Inside and outside of surfaces that do not close.
#pragma once

#include <ecorche/values/mesh.hpp>
#include "preprocess/voxel/rasterize.hpp"

namespace ecorche::voxel {

/// What was found inside, and what a look at up to 20 000 voxels says of the rest: at those from which the
/// surface is seen along three of the six axes or more (in the mouth of a wide opening it is not).
struct OpenInside {
  static constexpr double most_lost = 0.05;  ///< holes that take more leave a shell, not a body

  std::size_t voxels = 0;  ///< marked as inside
  double expected_ml = 0;  ///< of the untouched space that winding numbers call inside
  double lost = 0;         ///< the share of it that flooded away
};

/// Marks what is inside an open surface: what a flood from outside cannot reach through untouched voxels
/// falls into parts, and each part asks one generalized winding number (geometry/winding_tree.hpp), the mean
/// of three of its voxels: inside from 1/2. A part under 8 voxels is taken as inside unasked. So slits and
/// holes up to a voxel are closed; through wider ones the inside floods away, and only the touched voxels
/// remain. `mask` must have an untouched margin.
OpenInside mark_inside_open(const SurfaceMesh& surface, const ImageGrid& grid, VoxelMask& mask,
                            const Context& context);

}  // namespace ecorche::voxel
