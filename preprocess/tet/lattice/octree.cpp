// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/octree.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

using Cell = BccLattice::Cell;

/// A grid of labels, 0 where a block is none.
struct Grid {
  Cell count{0, 0, 0};
  std::vector<std::uint16_t> label;

  explicit Grid(const Cell& n)
      : count(n),
        label(
            static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]),
            0) {}

  std::size_t at(const Cell& c) const {
    return (static_cast<std::size_t>(c[2]) * static_cast<std::size_t>(count[1]) +
            static_cast<std::size_t>(c[1])) *
               static_cast<std::size_t>(count[0]) +
           static_cast<std::size_t>(c[0]);
  }
  bool holds(const Cell& low, std::int32_t width) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (low[axis] < 0 || low[axis] + width > count[axis]) return false;
    return true;
  }
  /// Whether `test` holds for every block of a box that lies in the grid.
  template <class Test>
  bool all(const Cell& low, std::int32_t width, const Test& test) const {
    if (!holds(low, width)) return false;
    for (std::int32_t k = low[2]; k < low[2] + width; ++k)
      for (std::int32_t j = low[1]; j < low[1] + width; ++j)
        for (std::int32_t i = low[0]; i < low[0] + width; ++i)
          if (!test(label[at({i, j, k})])) return false;
    return true;
  }
  /// `own(cell)` becomes the label of every block.
  template <class Own>
  void fill(const Own& own) {
    tbb::parallel_for(0, count[2], [&](std::int32_t k) {
      for (std::int32_t j = 0; j < count[1]; ++j)
        for (std::int32_t i = 0; i < count[0]; ++i) label[at({i, j, k})] = own(Cell{i, j, k});
    });
  }
};

Cell shifted(const Cell& c, std::int32_t by) {
  return {c[0] + by, c[1] + by, c[2] + by};
}
Cell twice(const Cell& c) {
  return {2 * c[0], 2 * c[1], 2 * c[2]};
}

/// The label of all tets of a cube, 0 where they have several or none.
std::uint16_t label_of_star(const Clipped& clipped, const Cell& c) {
  const std::int64_t centre = clipped.lattice.first_centre() + clipped.lattice.cube(c);
  const auto kept = [&](std::int64_t slot) { return clipped.kept[static_cast<std::size_t>(slot)]; };
  // Most cubes that have two labels show them among their own twelve tets, which lie together.
  const std::int64_t own = BccLattice::slots_per_cube * clipped.lattice.cube(c);
  const std::uint16_t label = kept(own);
  for (int s = 1; s < BccLattice::slots_per_cube; ++s)
    if (kept(own + s) != label) return voxel::outside;
  if (label == voxel::outside || !clipped.lattice.has_whole_star(centre)) return voxel::outside;
  for (const std::int64_t slot : clipped.lattice.around(centre))
    if (kept(slot) != label) return voxel::outside;
  return label;
}

}  // namespace

Octree::Octree(const Clipped& clipped)
    : lattice_(clipped.lattice), levels_(static_cast<std::size_t>(lattice_.cube_count()), 0) {
  Grid joined(lattice_.cubes());
  joined.fill([&](const Cell& c) { return label_of_star(clipped, c); });
  for (int level = 1; level <= most_levels; ++level) {
    Grid larger({joined.count[0] / 2, joined.count[1] / 2, joined.count[2] / 2});
    larger.fill([&](const Cell& c) -> std::uint16_t {
      const Cell first = twice(c);
      const std::uint16_t label = joined.label[joined.at(first)];
      if (label == voxel::outside ||
          !joined.all(first, 2, [&](std::uint16_t other) { return other == label; }))
        return voxel::outside;
      // Of the smallest cubes all may touch; larger ones only leaves that are joined themselves.
      return level == 1 || joined.all(shifted(first, -1), 4,
                                      [](std::uint16_t other) { return other != voxel::outside; })
                 ? label
                 : voxel::outside;
    });
    const std::int32_t side = 1 << level;
    tbb::parallel_for(0, larger.count[2], [&](std::int32_t k) {
      for (std::int32_t j = 0; j < larger.count[1]; ++j)
        for (std::int32_t i = 0; i < larger.count[0]; ++i) {
          if (larger.label[larger.at({i, j, k})] == voxel::outside) continue;
          for (std::int32_t z = k * side; z < (k + 1) * side; ++z)
            for (std::int32_t y = j * side; y < (j + 1) * side; ++y) {
              const auto row = levels_.begin() + lattice_.cube({i * side, y, z});
              std::fill(row, row + side, static_cast<std::uint8_t>(level));
            }
        }
    });
    joined = std::move(larger);
  }
}

std::vector<std::int64_t> Octree::cubes_by_level() const {
  std::vector<std::int64_t> count(most_levels + 1, 0);
  for (const std::uint8_t level : levels_) ++count[level];
  return count;
}

}  // namespace ecorche::tet
