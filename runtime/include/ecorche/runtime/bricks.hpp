// SPDX-License-Identifier: Apache-2.0
// Regions of a posed grid, and the bricks that it is made again by.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

/// A region of the posed grid: first and last index, both in; empty where one is above the other.
struct VoxelRange {
  std::array<std::int32_t, 3> first{}, last{};

  /// Meets no other.
  static VoxelRange nothing() {
    constexpr std::int32_t most = std::numeric_limits<std::int32_t>::max();
    return {{most, most, most}, {-1, -1, -1}};
  }
  /// Whether it holds no voxel.
  bool empty() const { return first[0] > last[0] || first[1] > last[1] || first[2] > last[2]; }
  /// The least that holds both.
  VoxelRange around(const VoxelRange& other) const {
    VoxelRange out;
    for (std::size_t a = 0; a < 3; ++a) {
      out.first[a] = std::min(first[a], other.first[a]);
      out.last[a] = std::max(last[a], other.last[a]);
    }
    return out;
  }
  /// Whether they share a voxel.
  bool meets(const VoxelRange& other) const {
    bool out = true;
    for (std::size_t a = 0; a < 3; ++a) out &= first[a] <= other.last[a] && last[a] >= other.first[a];
    return out;
  }
};

/// Cubes of a grid, x fastest; the last ones along an axis may be cut short.
struct Bricks {
  static constexpr std::int32_t edge = 32;  ///< voxels
  std::array<std::int32_t, 3> count{0, 0, 0};

  Bricks() = default;
  /// Those that hold the whole grid.
  explicit Bricks(const ImageGrid& grid) {
    for (std::size_t a = 0; a < 3; ++a) count[a] = (grid.size[a] + edge - 1) / edge;
  }
  /// How many.
  std::size_t all() const {
    return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
           static_cast<std::size_t>(count[2]);
  }
  /// Brick (0, y, z) of voxel row (y, z).
  std::size_t row_of(std::int32_t y, std::int32_t z) const {
    return static_cast<std::size_t>(count[0]) *
           (static_cast<std::size_t>(y / edge) +
            static_cast<std::size_t>(count[1]) * static_cast<std::size_t>(z / edge));
  }
  /// The voxels of brick `b`.
  VoxelRange voxels(std::size_t b, const ImageGrid& grid) const {
    VoxelRange out;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto along = static_cast<std::size_t>(count[a]);
      out.first[a] = edge * static_cast<std::int32_t>(b % along);
      out.last[a] = std::min(out.first[a] + edge, grid.size[a]) - 1;
      b /= along;
    }
    return out;
  }
};

/// The bricks to draw; #bricks, none: all of the grid.
struct BrickMask {
  Bricks bricks;
  const std::uint8_t* moved = nullptr;

  /// Whether there is a mask.
  explicit operator bool() const { return moved != nullptr; }
  /// Whether the brick of voxel (x, y, z) is marked.
  bool has(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return moved[bricks.row_of(y, z) + static_cast<std::size_t>(x / Bricks::edge)] != 0;
  }
  /// Whether a brick of the mask reaches into the voxels from `first` to `last`.
  bool meets(const std::array<std::int32_t, 3>& first, const std::array<std::int32_t, 3>& last) const {
    for (std::int32_t z = first[2] / Bricks::edge; z <= last[2] / Bricks::edge; ++z) {
      for (std::int32_t y = first[1] / Bricks::edge; y <= last[1] / Bricks::edge; ++y) {
        for (std::int32_t x = first[0] / Bricks::edge; x <= last[0] / Bricks::edge; ++x) {
          if (has(Bricks::edge * x, Bricks::edge * y, Bricks::edge * z)) return true;
        }
      }
    }
    return false;
  }
};

}  // namespace ecorche::runtime
