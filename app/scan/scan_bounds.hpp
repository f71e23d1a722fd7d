// SPDX-License-Identifier: Apache-2.0
// From where to where something lies, for messages.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include <ecorche/values/image.hpp>

namespace ecorche::app {

/// A box along LPS, mm; empty where nothing was added.
struct Bounds {
  std::array<double, 3> low{1, 1, 1}, high{0, 0, 0};

  bool empty() const { return low[0] > high[0]; }
  void add(const std::array<double, 3>& p) {
    const bool first = empty();
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = first ? p[a] : std::min(low[a], p[a]);
      high[a] = first ? p[a] : std::max(high[a], p[a]);
    }
  }
  /// `from [0, 0, 0] to [10, 20, 30] mm`.
  std::string in_words() const;
};

/// Of the voxels, by their place in memory, for which `in` is true.
template <class F>
Bounds bounds_where(const ImageGrid& grid, F&& in) {
  Bounds out;
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      int first = -1, last = -1;  // of a row only its ends can be the box's
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        if (!in(at)) continue;
        if (first < 0) first = i;
        last = i;
      }
      if (first < 0) continue;
      out.add(grid.point(first, j, k));
      out.add(grid.point(last, j, k));
    }
  }
  return out;
}

/// Of the voxels that are greater than `least`. `image` has one component.
Bounds bounds_above(const Image& image, double least);

}  // namespace ecorche::app
