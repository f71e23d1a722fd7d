// SPDX-License-Identifier: Apache-2.0
// A surface to look at before refilling (Gagvani01 6): a few of the balls, as coarse spheres.
#pragma once

#include <cstddef>

#include <ecorche/values/mesh.hpp>
#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// Space is cut into as fine cubes as give at most `most` of them a ball; the largest ball of each, at its
/// posed place, is drawn as a sphere of 42 vertices and 80 triangles on the ball's radius, facing outwards,
/// LPS mm. O(balls) whatever the thinness.
SurfaceMesh preview(const BallSet& set, std::size_t most = 4000);

}  // namespace ecorche::runtime
