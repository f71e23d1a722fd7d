// SPDX-License-Identifier: Apache-2.0
// What joints were found on.
#pragma once

#include <vector>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::rig {

struct FoundPoint;

/// What a joint's centre was found on, for pictures, and how sure centre and axes are by themselves.
struct JointEvidence {
  CenterRule rule = CenterRule::given;
  double center_confidence = 1, axes_confidence = 1;  ///< `JointFit::confidence` is at most the least of both
  Eigen::Vector3d at = Eigen::Vector3d::Zero();       ///< LPS mm
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();     ///< unit: of a cylinder, or a plane's normal; else zero
  double radius = 0;                                  ///< mm, of a sphere, a cylinder or an ellipse; else 0
  std::vector<Eigen::Vector3d> vertices;              ///< LPS mm
};

/// What `found` shows.
JointEvidence evidence_of(const FoundPoint& found, double center_confidence, double axes_confidence);

}  // namespace ecorche::rig
