// SPDX-License-Identifier: Apache-2.0
// Points and directions as they were found on bones, and how sure they are.
#pragma once

#include <vector>

#include "preprocess/rig/bone_points.hpp"

namespace ecorche::rig {

/// A point, and how well it was found.
struct FoundPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  JointFit fit{};  ///< without its joint's name
  /// How the vertices of a centroid lie about it, mm^2; zero of other rules.
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< unit: a cylinder's, or a plane's normal; else zero
  std::vector<const SurfacePoints*> on{};          ///< what it was found on
};

/// Of a mean of vertices that lie `spread` mm (rms) about it: a joint's centre may be anywhere among them, so
/// 10 mm halve it.
inline double centroid_confidence(double spread) {
  return 1 / (1 + (spread / 10) * (spread / 10));
}

struct FoundDirection {
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();  ///< unit
  double confidence = 1;
};

/// What `fit` (a sphere, a cylinder, a plane, an ellipse) found on `on`; `size`: its radius, or 0.
template <class Fit>
FoundPoint fitted_point(CenterRule rule, const Fit& fit, double size, const SurfacePoints& on) {
  FoundPoint found;
  found.at = fit.center;
  found.fit = {"",
               rule,
               size,
               fit.residual,
               fit.inlier_share,
               static_cast<std::int32_t>(on.at.rows()),
               fit.confidence};
  found.on = {&on};
  return found;
}

/// A point that the rule says, sure.
FoundPoint said_point(const Eigen::Vector3d& at);

/// Of marked vertices each counts the same; of a part of the surface each as its area does, or a mesh that is
/// finer on one side would draw the mean there.
FoundPoint centroid_of(const SurfacePoints& on);

/// The middle of a plate, the `rows` of `points`, is as sure as it is small: vertices 25 mm about it halve
/// it.
double plate_confidence(const Points& points, const std::vector<Eigen::Index>& rows);

/// Of a direction between points that are off by such an angle (rad).
double angle_confidence(double angle);

/// How far off a point may be across a direction, mm.
double off_across(const FoundPoint& point, const Eigen::Vector3d& along);

}  // namespace ecorche::rig
