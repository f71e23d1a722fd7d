// SPDX-License-Identifier: Apache-2.0
// Points by the cells of a grid.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

/// Points in the order of their cells, so that those of neighbouring cells of a row lie one after the other.
class PointCells {
 public:
  struct Point {
    double x, y, z;
    std::uint32_t row;  ///< of the points that were given
  };

  /// Those within `box`, faces included; the others are left out. Cells are cubes of about `edge`, larger
  /// where there would be more than four of them a point.
  PointCells(const Points& points, const Eigen::AlignedBox3d& box, double edge);

  const std::vector<Point>& all() const { return all_; }

  /// Calls f(begin, end) for ranges of `all` that together hold every point of the box `low` to `high`, and
  /// others about it.
  template <class F>
  void for_ranges(const std::array<double, 3>& low, const std::array<double, 3>& high, F&& f) const {
    std::array<std::int64_t, 3> first, last;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = cell(axis, low[axis]);
      last[axis] = cell(axis, high[axis]);
    }
    for (std::int64_t k = first[2]; k <= last[2]; ++k) {
      for (std::int64_t j = first[1]; j <= last[1]; ++j) {
        const auto row = static_cast<std::size_t>((k * size_[1] + j) * size_[0]);
        const std::uint32_t begin = begin_[row + static_cast<std::size_t>(first[0])];
        const std::uint32_t end = begin_[row + static_cast<std::size_t>(last[0]) + 1];
        if (begin < end) f(begin, end);
      }
    }
  }

 private:
  std::int64_t cell(std::size_t axis, double x) const {
    const auto at = static_cast<std::int64_t>((x - low_[axis]) * per_mm_);
    return at < 0 ? 0 : at < size_[axis] ? at : size_[axis] - 1;
  }
  std::size_t cell_of(double x, double y, double z) const {
    return static_cast<std::size_t>((cell(2, z) * size_[1] + cell(1, y)) * size_[0] + cell(0, x));
  }

  std::array<double, 3> low_{};
  double per_mm_ = 1;
  std::array<std::int64_t, 3> size_{1, 1, 1};
  std::vector<std::uint32_t> begin_;  // #cells + 1
  std::vector<Point> all_;
};

}  // namespace ecorche::mapping
