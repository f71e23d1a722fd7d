// SPDX-License-Identifier: Apache-2.0
// Anatomical angles, limits and coupling of joints.
#pragma once

#include <array>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// The rotation from the scanned rest pose, in the joint's frame, at which the joint has these anatomical
/// angles (radians, in `sequence` order, absolute): R(rest)^-1 * R(angles), R intrinsic along the sequence.
/// Throws Error{config} for a sequence that is not three different axes.
Eigen::Quaterniond rotation_from_angles(const Joint& joint, const std::array<double, 3>& angles);

/// The anatomical angles (radians, absolute) of a rotation from rest: the inverse of the function above. The
/// middle angle lies in [-pi/2, pi/2]; in gimbal lock the third angle is its rest value.
/// Throws Error{config} for a sequence that is not three different axes.
std::array<double, 3> angles_from_rotation(const Joint& joint, const Eigen::Quaterniond& rotation);

/// What the joint can do of `rotation`: kinds drop the turns they lack, limits clamp the rest along the Euler
/// sequence. A hinge keeps the twist about its axis (swing-twist); a universal joint keeps its first two
/// angles. Of the two Euler triples that give one rotation, the one that loses less is clamped; turns are
/// taken modulo 360 degrees, so that limits beyond 180 degrees mean what they say. A range always reaches to
/// the rest angle: the scan itself is never refused. A rotation within its limits comes back bit by bit.
Eigen::Quaterniond clamp(const Joint& joint, const Eigen::Quaterniond& rotation);

/// Whether another joint sets one of its angles.
bool drives_angles(const Joint& joint);

/// What the joint of segment `row` makes of `pose`: each coupled angle
///   rest + sum of ratio * (angle of the leading joint - its rest),
/// radians, the others as they are. Throws Error{config} where a coupling names what is not there.
Eigen::Quaterniond follow(const Skeleton& skeleton, const Pose& pose, std::size_t row);

/// Normalises and clamps every joint of `pose`, then sets each coupled angle as follow() has it,
/// in row order (a leading joint that is itself driven must come earlier), and clamps it too; appends what
/// was taken away (more than 1e-6 rad) to `clamped`, a joint once. A non-root translation of a joint that is
/// not `free` is removed; then its slides (Coupling::slides) are set from their leaders' angles. The root is
/// the body's place in the room: it is not clamped. Allocates nothing while `clamped` has room for every
/// joint.
void constrain(const Skeleton& skeleton, Pose& pose, std::vector<ClampedJoint>& clamped);

/// The slides alone, from the angles as they are. Leaves `free` joints and those without couplings as they
/// are.
void slide(const Skeleton& skeleton, Pose& pose);

}  // namespace ecorche::kinematics
