// SPDX-License-Identifier: Apache-2.0
// Figure 6 of Gagvani01: a cylinder with a bar along its axis, bent in the middle.
#pragma once

#include <Eigen/Geometry>
#include <numbers>
#include <vector>

#include <ecorche/values/transform.hpp>
#include "tests/support/slow_skeleton.hpp"

namespace ecorche::test {

struct BentCylinder {
  Image volume;                 ///< u8: 0 outside, 1 the cylinder, 2 the bar
  VolumetricSkeleton skeleton;  ///< segment 0 below the bend, 1 above
  static constexpr int radius = 7, bar = 2, length = 44, bend = 22;

  explicit BentCylinder(double thinness) {
    ImageGrid grid;
    grid.size = {2 * radius + 5, 2 * radius + 5, length};
    grid.origin = {-12.5, 40, 900};
    constexpr int middle = radius + 2;
    const auto within = [](int i, int j, int r) {
      return (i - middle) * (i - middle) + (j - middle) * (j - middle) <= r * r;
    };
    const Image mask = mask_where(
        grid, [&](int i, int j, int k) { return k > 0 && k < length - 1 && within(i, j, radius); });
    const Image inner =
        mask_where(grid, [&](int i, int j, int k) { return k > 3 && k < length - 4 && within(i, j, bar); });
    volume = mask;
    for (std::size_t v = 0; v < grid.voxels(); ++v) {
      if (inner.scalars<std::uint8_t>()[v] != 0) volume.scalars<std::uint8_t>()[v] = 2;
    }
    skeleton = slow_skeleton(mask, thinness);
    for (std::size_t v = 0; v < skeleton.size(); ++v)
      skeleton.segment[v] = skeleton.voxel[v][2] < bend ? 0 : 1;
  }

  /// The upper half turned by so many degrees about the x axis through the bend.
  std::vector<RigidTransform> bent(double degrees) const {
    const auto at = skeleton.grid.point(radius + 2, radius + 2, bend);
    const Eigen::Vector3d c(at[0], at[1], at[2]);
    const Eigen::Quaterniond q(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitX()));
    return {{}, {q, c - q * c}};
  }
};

}  // namespace ecorche::test
