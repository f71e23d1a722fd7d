// SPDX-License-Identifier: Apache-2.0
// The obvious winding number: every triangle's solid angle.
#pragma once

#include <numbers>

#include "core/geometry/winding_tree.hpp"

namespace ecorche::voxel {

/// The solid angle of the whole surface seen from `p`, over 4 pi: about 1 inside, 0 outside.
inline double generalized_winding(const SurfaceMesh& surface, const Eigen::Vector3d& p) {
  double angle = 0;
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    const auto corner = [&](Eigen::Index c) -> Eigen::Vector3d {
      return surface.V.row(surface.F(f, c)).transpose() - p;
    };
    angle += geometry::half_solid_angle(corner(0), corner(1), corner(2));
  }
  return angle / (2 * std::numbers::pi);
}

}  // namespace ecorche::voxel
