// SPDX-License-Identifier: Apache-2.0
// Two triples of angles give the same rotation: which of them a joint's limits mean.
#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// The ends of an angle's range as `clamp` has them.
std::pair<double, double> angle_range(const Joint& joint, std::size_t angle);

/// The same rotation by the other triple: R(a) R(b) R(c) = R(a + pi) R(pi - b) R(c + pi).
std::array<double, 3> other_triple(const Joint& joint, const std::array<double, 3>& angles);

/// The anatomical angles of a rotation (radians, absolute): of its two triples the one that is less outside
/// of the limits, so that a shoulder abducted by 110 degrees is that, and not 70 degrees behind half a turn.
/// Zeros for a joint without a sequence.
std::array<double, 3> angles_within_limits(const Joint& joint, const Eigen::Quaterniond& rotation);

}  // namespace ecorche::kinematics
