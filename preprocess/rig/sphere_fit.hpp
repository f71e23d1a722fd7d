// SPDX-License-Identifier: Apache-2.0
// A sphere through noisy points with outliers.
#pragma once

#include <optional>

#include "core/values/mesh.hpp"

namespace ecorche::rig {

struct SphereFit {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0;        ///< mm
  double residual = 0;      ///< mm, rms distance from the sphere of the points within 25 % of its radius
  double inlier_share = 0;  ///< of the points, within the band in which the sphere was found
  double confidence = 0;    ///< 0 to 1 (robust.hpp)
};

/// RANSAC (Fischler and Bolles 1981; truncated squares as in MSAC; draws from a fixed seed), then a
/// least-squares refinement of the true distances on the inliers. The band is 2.5 % of the extent of the
/// points, the same for every hypothesis. Spheres wider than that extent are not considered: a flat patch is
/// no joint. Nothing when there are fewer than four points or no sphere passes through any four of them.
std::optional<SphereFit> fit_sphere(const Points& points);

}  // namespace ecorche::rig
