// SPDX-License-Identifier: Apache-2.0
// A sphere through noisy points with outliers.
#pragma once

#include <optional>

#include "preprocess/rig/surface_points.hpp"

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

/// The same sphere on all of a bone: from what faces another bone, its upper half perhaps, to every vertex
/// within 8 % of the radius whose normal points away from the centre, in turn with least squares. `first`
/// comes back where it is no good one (residual above a tenth of the radius, fewer than half inliers),
/// wanders off (a quarter of the radius, or by a fifth of it), or finds fewer than twelve.
SphereFit grown_sphere(const SurfacePoints& bone, const SphereFit& first);

}  // namespace ecorche::rig
