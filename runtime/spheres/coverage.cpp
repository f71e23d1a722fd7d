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

// Joins the runs of two rows that touch, corners included.
void join(const Runs& runs, std::size_t row, std::size_t other, std::vector<std::size_t>& parent) {
  std::size_t a = runs.first[row], b = runs.first[other];
  while (a < runs.first[row + 1] && b < runs.first[other + 1]) {
    if (runs.run[a].begin <= runs.run[b].end && runs.run[b].begin <= runs.run[a].end) {
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

std::size_t parts_of(const Image& mask, std::size_t least) {
  const Runs runs = runs_of(mask);
  std::vector<std::size_t> parent(runs.run.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto rows = static_cast<std::size_t>(mask.grid.size[1]);
  for (std::size_t k = 0; k < static_cast<std::size_t>(mask.grid.size[2]); ++k) {
    for (std::size_t j = 0; j < rows; ++j) {
      const std::size_t row = j + rows * k;
      if (j > 0) join(runs, row, row - 1, parent);
      if (k == 0) continue;
      for (std::size_t beside = j > 0 ? j - 1 : 0; beside < std::min(j + 2, rows); ++beside) {
        join(runs, row, beside + rows * (k - 1), parent);
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
