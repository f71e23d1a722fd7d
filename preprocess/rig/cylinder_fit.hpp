// SPDX-License-Identifier: Apache-2.0
// A cylinder through noisy points with outliers: condyles, the trochlea, the ankle.
#pragma once

#include <optional>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

struct CylinderFit {
  Eigen::Vector3d center =
      Eigen::Vector3d::Zero();  ///< on the axis, amid the inliers: between their 5th and 95th percentiles
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit; its sign means nothing
  double radius = 0;                                ///< mm
  double residual = 0;  ///< mm, rms distance from the cylinder of the points within 25 % of its radius
  double inlier_share = 0;
  double confidence = 0;  ///< 0 to 1 (robust.hpp)
};

/// Circles through three points along 300 directions, the best few refined by least squares of the true
/// distances (robust.hpp; draws from a fixed seed, at most 600 of the points). Radii above the points' extent
/// are not considered. Nothing when there are fewer than six points, or they lie on no cylinder.
std::optional<CylinderFit> fit_cylinder(const Points& points);

}  // namespace ecorche::rig
