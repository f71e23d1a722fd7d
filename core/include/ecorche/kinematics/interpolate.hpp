// SPDX-License-Identifier: Apache-2.0
// Poses between poses.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/pose.hpp>

namespace ecorche::kinematics {

/// From `a` (t = 0) to `b` (t = 1): joints turn the shorter way at an even pace (slerp, Shoemake 1985), ways
/// are straight. Both have the same joints (throws Error{internal}).
Pose between(const Pose& a, const Pose& b, double t);

/// How a sequence goes from key to key.
enum class Ease : std::uint8_t {
  linear,  ///< at an even pace
  smooth,  ///< slowly off and slowly there: 3 t^2 - 2 t^3
};

/// Poses at times.
struct PoseKeys {
  std::vector<double> seconds;  ///< ascending
  std::vector<Pose> pose;       ///< as many
  Ease ease = Ease::linear;
};

/// The pose at a time; before the first and after the last key, that key's. Throws Error{internal} for no
/// keys.
Pose at(const PoseKeys& keys, double seconds);

}  // namespace ecorche::kinematics
