// SPDX-License-Identifier: Apache-2.0
// A plane through noisy points with outliers: plateaus and endplates.
#pragma once

#include <optional>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

struct PlaneFit {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< mean of the inliers
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit; its sign means nothing
  double residual = 0;  ///< mm, rms distance of the points within 10 % of the extent
  double inlier_share = 0;
  double confidence = 0;           ///< 0 to 1 (robust.hpp)
  std::vector<Eigen::Index> rows;  ///< the inliers: rows of the points
};

/// Planes through three points (robust.hpp; draws from a fixed seed), then the least-squares plane of the
/// inliers. Nothing when there are fewer than three points or all lie on a line.
std::optional<PlaneFit> fit_plane(const Points& points);

}  // namespace ecorche::rig
