// SPDX-License-Identifier: Apache-2.0
// Balls in sixteenths of a voxel, so that who owns a voxel is decided in whole numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "runtime/spheres/owners.hpp"

namespace ecorche::runtime {

/// A ball in sixteenths of a voxel from a box's first voxel.
struct FixedBall {
  std::array<std::int64_t, 3> centre;
  std::int32_t limit;  ///< 256 times the squared radius, rounded up: it holds what is nearer
  /// Voxels of the box that it may hold, both ends included, cut to the box.
  std::array<std::int32_t, 3> low, high;
};

inline std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// Rounded in the lattice, so that the box has no say.
inline std::int64_t sixteenths(double x) {
  return static_cast<std::int64_t>(std::floor(16 * x + 0.5));
}

/// What rounding leaves of 256 r^2, a whole number where the lattice is the skeleton's, is not counted.
inline std::int32_t limit_of(double radius2) {
  return static_cast<std::int32_t>(std::ceil(256 * radius2 - 1e-6));
}

/// Every offset from the centre of a voxel that the ball holds is at most this, sixteenths; -1: it holds
/// none.
inline std::int64_t reach_of(std::int32_t limit) {
  return limit <= 0 ? -1 : static_cast<std::int64_t>(std::sqrt(static_cast<double>(limit - 1)));
}

/// False where the ball holds nothing of the box.
inline bool fix(const Ball& ball, const LatticeBox& box, FixedBall& out) {
  out.limit = limit_of(ball.radius2);
  const std::int64_t reach = reach_of(out.limit);
  if (reach < 0) return false;
  for (std::size_t a = 0; a < 3; ++a) {
    out.centre[a] = sixteenths(ball.centre[a]) - 16 * std::int64_t{box.first[a]};
    const std::int64_t low = -floor_div(reach - out.centre[a], 16),
                       high = floor_div(out.centre[a] + reach, 16);
    out.low[a] = static_cast<std::int32_t>(std::max<std::int64_t>(low, 0));
    out.high[a] = static_cast<std::int32_t>(std::min<std::int64_t>(high, box.size[a] - 1));
    if (out.low[a] > out.high[a]) return false;
  }
  return true;
}

/// Throws Error{data} for a ball that is not finite, lies more than a million voxels away, or is larger than
/// kMostRadius.
void check(const Ball& ball, std::size_t row);

}  // namespace ecorche::runtime
