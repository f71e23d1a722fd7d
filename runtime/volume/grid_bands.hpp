// SPDX-License-Identifier: Apache-2.0
// A grid cut into slabs that are drawn each on its own.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <ecorche/runtime/bricks.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

/// Slices of the grid in bands, along its longer one of the two slow axes: a slice plane has only one slice.
class GridBands {
 public:
  explicit GridBands(const ImageGrid& grid) : axis_(grid.size[2] >= grid.size[1] ? 2U : 1U) {
    constexpr std::int32_t low = 16;   // slices: a few tets high
    constexpr std::int32_t high = 32;  // where there are many: fewer tets lie in two
    const std::int32_t slices = grid.size[axis_];
    height_ = slices < 8 * high ? low : high;
    count_ = static_cast<std::size_t>((slices + height_ - 1) / height_);
  }

  std::size_t count() const { return count_; }
  VoxelRange of(std::size_t band, const ImageGrid& grid) const {
    VoxelRange range{{}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};
    range.first[axis_] = static_cast<std::int32_t>(band) * height_;
    range.last[axis_] = std::min(range.first[axis_] + height_, grid.size[axis_]) - 1;
    return range;
  }

 private:
  std::size_t axis_, count_ = 0;
  std::int32_t height_ = 0;
};

}  // namespace ecorche::runtime
