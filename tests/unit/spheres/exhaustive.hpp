// SPDX-License-Identifier: Apache-2.0
// Refilling by its definition: every voxel asks every ball. The rules are written once more, in plain words.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "runtime/spheres/balls.hpp"
#include "runtime/spheres/owners.hpp"

namespace ecorche::test {

enum class Who {
  nearest,  ///< the proximity buffer
  last,     ///< whoever is drawn last, as without one
};

/// Calls f(i, j, k) for every voxel of a box, in lattice indices, i fastest.
template <class F>
void for_voxels(const runtime::LatticeBox& box, F&& f) {
  for (std::int32_t k = 0; k < box.size[2]; ++k) {
    for (std::int32_t j = 0; j < box.size[1]; ++j) {
      for (std::int32_t i = 0; i < box.size[0]; ++i) f(box.first[0] + i, box.first[1] + j, box.first[2] + k);
    }
  }
}

/// Row of the ball that owns voxel (x, y, z) of the lattice, or -1.
inline std::int32_t owner_of(const runtime::BallSet& set, std::int64_t x, std::int64_t y, std::int64_t z,
                             Who who = Who::nearest) {
  const auto fixed = [](double at) { return static_cast<std::int64_t>(std::floor(16 * at + 0.5)); };
  std::int32_t best = -1;
  std::int64_t least = 0;
  for (std::size_t b = 0; b < set.balls.size(); ++b) {
    const runtime::Ball& ball = set.balls[b];
    const std::int64_t dx = 16 * x - fixed(ball.centre[0]), dy = 16 * y - fixed(ball.centre[1]),
                       dz = 16 * z - fixed(ball.centre[2]);
    const std::int64_t far = dx * dx + dy * dy + dz * dz;
    if (static_cast<double>(far) >= 256 * ball.radius2 - 1e-6) continue;
    // Bridges come last, and own only what nobody holds.
    const bool bridge = static_cast<std::int32_t>(b) >= set.bridges_from;
    if (best >= 0 && bridge && best < set.bridges_from) continue;
    if (best >= 0 && who == Who::nearest && far >= least) continue;
    best = static_cast<std::int32_t>(b);
    least = far;
  }
  return best;
}

}  // namespace ecorche::test
