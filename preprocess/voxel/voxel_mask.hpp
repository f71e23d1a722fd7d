// SPDX-License-Identifier: Apache-2.0
// Voxels of one surface, a bit each.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "preprocess/voxel/snapped_surface.hpp"

namespace ecorche::voxel {

/// A box of voxels of a grid in two planes of bits. Rows along i begin with a whole word; voxel i of the grid
/// is bit i mod 64 of its word in every mask, so that words of different masks may be compared.
struct VoxelMask {
  Vec3i low{0, 0, 0};                  ///< its first voxel in the grid, not negative
  Vec3i size{0, 0, 0};                 ///< voxels along each axis
  std::vector<std::uint64_t> touched;  ///< a triangle meets the closed voxel
  std::vector<std::uint64_t> inside;   ///< the winding number of the centre is not 0

  VoxelMask() = default;
  VoxelMask(const Vec3i& low_, const Vec3i& size_) : low(low_), size(size_) {
    const std::size_t words =
        row_words() * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
    touched.assign(words, 0);
    inside.assign(words, 0);
  }

  /// Words before its rows' first in a row of the grid.
  std::size_t first_word() const { return static_cast<std::size_t>(low[0]) / 64; }
  std::size_t row_words() const {
    return size[0] == 0 ? 0 : static_cast<std::size_t>(low[0] + size[0] - 1) / 64 - first_word() + 1;
  }
  /// The first word of a row; j and k, as all below, are the grid's.
  std::size_t row(int j, int k) const {
    return row_words() * (static_cast<std::size_t>(j - low[1]) +
                          static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k - low[2]));
  }
  std::size_t word(int i, int j, int k) const {
    return row(j, k) + (static_cast<std::size_t>(i) / 64 - first_word());
  }
  static std::uint64_t bit(int i) { return std::uint64_t{1} << (static_cast<unsigned>(i) % 64); }
  bool is_touched(int i, int j, int k) const { return (touched[word(i, j, k)] & bit(i)) != 0; }
  bool is_inside(int i, int j, int k) const { return (inside[word(i, j, k)] & bit(i)) != 0; }
};

/// Calls `visit(first bit, bits)` for every run of set bits of a word.
template <class Visit>
void for_runs(std::uint64_t word, Visit&& visit) {
  while (word != 0) {
    const int first = std::countr_zero(word), count = std::countr_one(word >> first);
    visit(first, count);
    if (first + count == 64) break;
    word &= ~std::uint64_t{0} << (first + count);
  }
}

}  // namespace ecorche::voxel
