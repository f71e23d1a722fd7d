// SPDX-License-Identifier: Apache-2.0
// Poses by the names of joints and angles.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// One named angle of a joint: its place in `sequence`, and the sign that turns the name's sense into that
/// angle's.
struct NamedAngle {
  std::size_t row = 0;  ///< of the joint
  std::size_t angle = 0;
  double sign = 1;
};

/// The angle `angle` of joint `joint`, or what the joint calls the opposite (adduction and abduction,
/// eversion and inversion, depression and elevation, dorsiflexion and an ankle's flexion) or the same
/// (lateral_bending and bending); nothing where it has neither.
std::optional<NamedAngle> find_named_angle(const Skeleton& skeleton, std::string_view joint,
                                           std::string_view angle);

/// An anatomical angle, and what it should be.
struct AngleValue {
  NamedAngle angle;
  double radians = 0;  ///< in the name's sense; several for one angle are added
};

/// The pose with these anatomical angles, absolute; all others are at rest.
Pose pose_of(const Skeleton& skeleton, const std::vector<AngleValue>& values);

}  // namespace ecorche::kinematics
