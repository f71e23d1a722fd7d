// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/coverage.hpp"

#include <atomic>
#include <numeric>
#include <vector>

namespace ecorche::runtime {
namespace {

// A run of covered voxels along i.
struct Run {
  std::int32_t begin, end;  // one past the last
};

// Runs of an image, and those of row r: first[r] .. first[r + 1].
struct Runs {
  std::vector<Run> run;
  std::vector<std::size_t> first;
};

Runs runs_of(const Image& mask) {
  const auto voxels = mask.scalars<std::uint8_t>();
  const std::int32_t width = mask.grid.size[0];
  Runs out;
  const std::size_t rows =
      static_cast<std::size_t>(mask.grid.size[1]) * static_cast<std::size_t>(mask.grid.size[2]);
  for (std::size_t r = 0; r < rows; ++r) {
    out.first.push_back(out.run.size());
    const std::uint8_t* row = voxels.data() + r * static_cast<std::size_t>(width);
    for (std::int32_t i = 0; i < width; ++i) {
      if (row[i] == 0) continue;
      const std::int32_t begin = i;
      while (i < width && row[i] != 0) ++i;
      out.run.push_back({begin, i});
    }
  }
  out.first.push_back(out.run.size());
  return out;
}

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t a) {
  while (parent[a] != a) a = parent[a] = parent[parent[a]];
  return a;
}

// Joins the runs of two rows that touch, corners included, or between which at most `gap` voxels lie. What
// the smaller end leaves behind lies farther off, or is joined along its own row.
void join(const Runs& runs, std::size_t row, std::size_t other, int gap, std::vector<std::size_t>& parent) {
  std::size_t a = runs.first[row], b = runs.first[other];
  while (a < runs.first[row + 1] && b < runs.first[other + 1]) {
    if (runs.run[a].begin <= runs.run[b].end + gap && runs.run[b].begin <= runs.run[a].end + gap) {
      parent[root_of(parent, a)] = root_of(parent, b);
    }
    runs.run[a].end < runs.run[b].end ? ++a : ++b;
  }
}

}  // namespace

std::size_t covered_voxels(const BallSet& set, const LatticeBox& box, const Context& context) {
  std::atomic<std::size_t> all{0};
  for_tiles(set, box, context, [&](const Tile& tile) {
    std::size_t here = 0;
    tile.for_owned([&](std::int32_t, std::int32_t, std::int32_t, std::int32_t) { ++here; });
    all += here;
  });
  return all;
}

Image covered(const BallSet& set, const LatticeBox& box, const Context& context) {
  Image out(grid_of(set.lattice, box), ScalarType::u8);
  const auto voxels = out.scalars<std::uint8_t>();
  for_tiles(set, box, context, [&](const Tile& tile) {
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t) {
      voxels[out.grid.offset(i, j, k)] = 1;
    });
  });
  return out;
}

std::size_t parts_of(const Image& mask, std::size_t least, Gap across) {
  const int gap = across == Gap::one_voxel ? 1 : 0;
  const Runs runs = runs_of(mask);
  std::vector<std::size_t> parent(runs.run.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const int rows = mask.grid.size[1];
  const auto row_of = [&](int j, int k) { return static_cast<std::size_t>(j + std::int64_t{rows} * k); };
  for (int k = 0; k < mask.grid.size[2]; ++k) {
    for (int j = 0; j < rows; ++j) {
      const std::size_t row = row_of(j, k);
      for (std::size_t r = runs.first[row] + 1; r < runs.first[row + 1]; ++r) {
        if (runs.run[r].begin - runs.run[r - 1].end <= gap)
          parent[root_of(parent, r)] = root_of(parent, r - 1);
      }
      for (int down = 0; down <= std::min(1 + gap, k); ++down) {
        const int last = down == 0 ? j - 1 : std::min(j + 1 + gap, rows - 1);
        for (int beside = std::max(j - 1 - gap, 0); beside <= last; ++beside)
          join(runs, row, row_of(beside, k - down), gap, parent);
      }
    }
  }
  std::vector<std::size_t> size(parent.size());
  for (std::size_t r = 0; r < parent.size(); ++r) {
    size[root_of(parent, r)] += static_cast<std::size_t>(runs.run[r].end - runs.run[r].begin);
  }
  std::size_t parts = 0;
  for (const std::size_t voxels : size) parts += voxels >= least && voxels > 0;
  return parts;
}

}  // namespace ecorche::runtime
