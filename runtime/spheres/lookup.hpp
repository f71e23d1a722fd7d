// SPDX-License-Identifier: Apache-2.0
// From a voxel of the posed lattice back to the rest lattice, through the ball that owns it.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/spheres/balls.hpp"
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {

/// The place at rest, index of the lattice, of what lies (dx, dy, dz) voxels from the ball's centre. Beyond
/// the ball's radius at rest (only an effect reaches there): that of the rest ball's rim in the same
/// direction, far enough within (half a voxel's diagonal) that the nearest voxel is the object's.
inline Vec3 rest_place(const BallSet& set, const Ball& ball, double dx, double dy, double dz) {
  const double far2 = dx * dx + dy * dy + dz * dz;
  if (ball.radius2 > ball.rest_radius2 && far2 >= ball.rest_radius2) {
    const double inside = std::max(std::sqrt(ball.rest_radius2) - 0.87, 0.0) / std::sqrt(far2);
    dx *= inside, dy *= inside, dz *= inside;
  }
  const auto& r = set.back[static_cast<std::size_t>(ball.motion)];
  return {ball.rest[0] + (r[0] * dx + r[1] * dy + r[2] * dz),
          ball.rest[1] + (r[3] * dx + r[4] * dy + r[5] * dz),
          ball.rest[2] + (r[6] * dx + r[7] * dy + r[8] * dz)};
}

/// Rest lattice -> index of the volume; exact where both are one lattice up to whole voxels.
class ToVolume {
 public:
  ToVolume(const ImageGrid& lattice, const ImageGrid& volume) : map_(to_index(volume) * to_space(lattice)) {
    same_ = true;
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j) same_ = same_ && std::abs(map_.linear(i, j) - (i == j)) < 1e-9;
      same_ = same_ && std::abs(map_.at[i] - std::round(map_.at[i])) < 1e-9;
    }
    // The same lattice up to whole voxels, so that rest stays exact.
    if (same_) map_.at = map_.at.array().round();
  }

  Vec3 operator()(const Vec3& p) const {
    if (same_) return {p[0] + map_.at[0], p[1] + map_.at[1], p[2] + map_.at[2]};
    const Eigen::Vector3d q = map_ * Eigen::Vector3d(p[0], p[1], p[2]);
    return {q[0], q[1], q[2]};
  }

 private:
  Affine map_;
  bool same_ = false;
};

}  // namespace ecorche::runtime
