// SPDX-License-Identifier: Apache-2.0
// At which turns of a joint finite elements are solved.
#pragma once

#include <Eigen/Core>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::correct {

struct Sample {
  Eigen::Vector3d from_rest;  ///< radians, along the joint's sequence
  Pose pose;                  ///< constrained: what follows the joint follows it here too
  Eigen::RowVector3d turn;    ///< rotation vector of the joint
  int from = -1;              ///< the sample nearer to rest on the same way, whose displacement is the start
};

/// Angles of a joint are looked at to here where they have no limit, and no farther where it lies beyond.
inline constexpr double kFarthest = 2.4;  // radians, 137.5 degrees

/// Whether the joint turns by itself: not the root, not fixed, and no coupling drives its first angle.
bool turns_by_itself(const Skeleton& skeleton, std::size_t joint);
/// How far an angle of a joint may be turned from rest towards larger (`way` 1) or smaller (-1) ones,
/// radians; 0 where its kind lacks it or a coupling drives it.
double reach(const Joint& joint, std::size_t angle, int way);
/// The joint alone turned so far from rest, along its sequence; constrained.
Pose turned(const Skeleton& skeleton, std::size_t joint, const Eigen::Vector3d& from_rest);
Sample sample_at(const Skeleton& skeleton, std::size_t joint, const Eigen::Vector3d& from_rest, int from);
/// Of a unit quaternion, at most half a turn.
Eigen::RowVector3d rotation_vector(const Eigen::Quaterniond& turn);

/// Of a hinge: every `step` radians or less, both ways. Of others: each angle alone in thirds of its reach,
/// then all together at a quarter and a half of theirs, every combination of ways. Each way is a chain from
/// rest. Deterministic; those that would lie at rest or on another are left out.
std::vector<Sample> samples_of(const Skeleton& skeleton, std::size_t joint, double step);

}  // namespace ecorche::correct
