// SPDX-License-Identifier: Apache-2.0
// Many places in cells: the nearest, and those within a distance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// Immutable; any number of threads may ask.
class Places {
 public:
  /// About two places a cell. At least one place, all finite.
  explicit Places(std::vector<Vec3> places);

  /// Row of the nearest, the lowest of those as near.
  std::size_t nearest(const Vec3& to) const;

  /// Calls f(row) for every place within `radius`, and for some beyond.
  template <class F>
  void for_near(const Vec3& to, double radius, F&& f) const {
    std::array<std::int32_t, 3> low{}, high{};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = cell(to[a] - radius, a);
      high[a] = cell(to[a] + radius, a);
    }
    for (std::int32_t k = low[2]; k <= high[2]; ++k) {
      for (std::int32_t j = low[1]; j <= high[1]; ++j) {
        const std::size_t row =
            static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(j + cells_[1] * k);
        const std::size_t from = first_[row + static_cast<std::size_t>(low[0])];
        const std::size_t end = first_[row + static_cast<std::size_t>(high[0]) + 1];
        for (std::size_t i = from; i < end; ++i) f(rows_[i]);
      }
    }
  }

  const Vec3& operator[](std::size_t row) const { return places_[row]; }

 private:
  std::int32_t cell(double x, std::size_t axis) const {
    const double at = (x - low_[axis]) / edge_;
    return at <= 0 ? 0 : at >= cells_[axis] ? cells_[axis] - 1 : static_cast<std::int32_t>(at);
  }

  std::vector<Vec3> places_;
  Vec3 low_{};
  double edge_ = 1, extent_ = 0;
  std::array<std::int32_t, 3> cells_{1, 1, 1};
  std::vector<std::size_t> first_;  // of every cell, and one more
  std::vector<std::size_t> rows_;   // by cell, ascending within
};

}  // namespace ecorche::runtime
