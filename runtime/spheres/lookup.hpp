// SPDX-License-Identifier: Apache-2.0
// From a voxel of the posed lattice back to the rest lattice, through the ball that owns it.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// The place at rest, index of the lattice, of posed index (x, y, z). Beyond the ball's radius at rest (only
/// an effect reaches there): the nearest place of the rest ball's rim.
inline Vec3 rest_place(const BallSet& set, const Ball& ball, double x, double y, double z) {
  double dx = x - ball.centre[0], dy = y - ball.centre[1], dz = z - ball.centre[2];
  if (ball.radius2 > ball.rest_radius2) {
    const double far2 = dx * dx + dy * dy + dz * dz;
    if (far2 >= ball.rest_radius2) {
      // The rim itself is outside: a hundredth of a voxel within.
      const double inside = std::max(std::sqrt(ball.rest_radius2) - 0.01, 0.0) / std::sqrt(far2);
      dx *= inside, dy *= inside, dz *= inside;
    }
  }
  const auto& r = set.back[static_cast<std::size_t>(ball.motion)];
  return {ball.rest[0] + (r[0] * dx + r[1] * dy + r[2] * dz),
          ball.rest[1] + (r[3] * dx + r[4] * dy + r[5] * dz),
          ball.rest[2] + (r[6] * dx + r[7] * dy + r[8] * dz)};
}

}  // namespace ecorche::runtime
