// SPDX-License-Identifier: Apache-2.0
// An ellipse in space: the rim of an endplate or of a cup.
#pragma once

#include <optional>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

struct EllipseFit {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, of its plane; its sign means nothing
  Eigen::Vector3d major = Eigen::Vector3d::UnitX();   ///< unit, along the longer half axis; its sign likewise
  double long_mm = 0, short_mm = 0;                   ///< half axes
  double residual = 0;  ///< mm, rms distance from the ellipse of the outline's points within 25 % of its size
  double inlier_share = 0;  ///< share of the points near the plane times that of the outline near the ellipse
  double confidence = 0;    ///< 0 to 1 (robust.hpp)
};

/// The plane first (plane_fit.hpp); its inliers' outline is the farthest point in each of 48 sectors about
/// their median, so that a rim and a filled plate give the same ellipse; conics through five of those
/// (robust.hpp; draws from a fixed seed), refined by least squares of the distances along rays from the
/// centre. Nothing where there is no plane, the outline has fewer than eight points, or no conic is an
/// ellipse.
std::optional<EllipseFit> fit_ellipse(const Points& points);

}  // namespace ecorche::rig
