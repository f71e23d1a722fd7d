// SPDX-License-Identifier: Apache-2.0
// Points along a space-filling curve.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

namespace ecorche::geometry {

/// Place of a point along the Morton curve of `box`, 21 bits an axis.
inline std::uint64_t morton(const Eigen::Vector3d& p, const Eigen::AlignedBox3d& box) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = std::max(box.max()[axis] - box.min()[axis], 1e-300);
    const double unit = std::clamp((p[axis] - box.min()[axis]) / extent, 0.0, 1.0);
    auto x = static_cast<std::uint64_t>(unit * 2097151.0);
    x = (x | x << 32) & 0x1f00000000ffffULL;  // two zero bits behind each bit
    x = (x | x << 16) & 0x1f0000ff0000ffULL;
    x = (x | x << 8) & 0x100f00f00f00f00fULL;
    x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
    x = (x | x << 2) & 0x1249249249249249ULL;
    code |= x << axis;
  }
  return code;
}

}  // namespace ecorche::geometry
