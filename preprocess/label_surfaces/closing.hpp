// SPDX-License-Identifier: Apache-2.0
// Making the outside of everything one smooth envelope.
#pragma once

#include <array>

#include <ecorche/values/context.hpp>
#include "preprocess/label_surfaces/mask.hpp"

namespace ecorche::label_surfaces {

/// Morphological closing by a ball of `radius_mm`: gaps up to twice as wide are filled. The mask's margin
/// must be wider than the radius. O(voxels).
void close_gaps(Mask& mask, const std::array<double, 3>& spacing, double radius_mm, const Context& context);

/// Fills what the outside does not reach through faces of voxels. O(voxels).
void fill_hollows(Mask& mask);

/// Takes away what is connected through faces of voxels and has fewer than `share` of the voxels of the
/// largest such piece. O(voxels).
void drop_specks(Mask& mask, double share);

}  // namespace ecorche::label_surfaces
