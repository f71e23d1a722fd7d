// SPDX-License-Identifier: Apache-2.0
// Anatomical angles, limits and coupling of joints.
#pragma once

#include <array>
#include <vector>

#include "core/values/pose.hpp"
#include "core/values/skeleton.hpp"

namespace ecorche::kinematics {

/// The rotation from the scanned rest pose, in the joint's frame, at which the joint has these anatomical angles
/// (radians, in `sequence` order, absolute): R(rest)^-1 * R(angles), R intrinsic along the sequence.
Eigen::Quaterniond rotation_from_angles(const Joint& joint, const std::array<double, 3>& angles);

/// The anatomical angles (radians, absolute) of a rotation from rest: the inverse of the function above. The middle
/// angle lies in [-pi/2, pi/2]; in gimbal lock the third angle is its rest value.
std::array<double, 3> angles_from_rotation(const Joint& joint, const Eigen::Quaterniond& rotation);

/// What the joint can do of `rotation`: kinds drop the turns they lack, limits clamp the rest along the Euler sequence.
Eigen::Quaterniond clamp(const Joint& joint, const Eigen::Quaterniond& rotation);

/// Clamps every joint of `pose`, then applies coupling; appends what was taken away (more than 1e-6 rad) to `clamped`.
/// A non-root translation of a joint that is neither `free` nor coupled is removed.
void constrain(const Skeleton& skeleton, Pose& pose, std::vector<ClampedJoint>& clamped);

}  // namespace ecorche::kinematics
