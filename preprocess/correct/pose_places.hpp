// SPDX-License-Identifier: Apache-2.0
// One whole pose, solved: what corrections of joints leave of it, place by place.
#pragma once

#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>

namespace ecorche::correct {

struct WholePose {
  std::string name;
  Pose pose;  ///< as the run time holds it: kinematics::constrain
};

struct PlaceOptions {
  double core_mm = 0.5;   ///< a place begins where a node is moved farther
  std::size_t few = 64;   ///< nodes: fewer are no place of their own where another has their joints
  double least_mm = 0.1;  ///< and ends where none about it is
  double reach = std::numbers::pi / 6;  ///< radians, at most: half of a correction is left at 0.54 of it
  double rounding_mm = 0.05;            ///< of quantise
  double alike = 0.05;  ///< radians: poses whose joints about a place differ by less are one there
};

/// What moves nodes from `skinned` (corrected already, as far as it is) to `settled` (3 * #nodes each, the
/// root at rest), by the joints about each place: nodes that the same joints move are one correction. It
/// reaches no farther than to rest, and to the nearest of `all` that is another there; `whole` may be among
/// them. Places that are at rest have none.
std::vector<PoseCorrection> pose_places(const Model& model, const WholePose& whole,
                                        std::span<const WholePose> all, std::span<const float> skinned,
                                        std::span<const float> settled, const PlaceOptions& options);

}  // namespace ecorche::correct
