// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/image/surface_distance.hpp"

#include <algorithm>
#include <array>

namespace ecorche::tet {
namespace {

constexpr std::uint8_t kAtBoundary = 2, kFar = 255;

struct Step {
  std::ptrdiff_t offset;
  int cost;
};

/// Neighbours that come before a voxel in memory, with their chamfer costs.
std::array<Step, 13> steps_before(std::ptrdiff_t row, std::ptrdiff_t layer) {
  std::array<Step, 13> steps{};
  std::size_t n = 0;
  for (int k = -1; k <= 0; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i) {
        const std::ptrdiff_t offset = i + j * row + k * layer;
        if (offset < 0) steps[n++] = {offset, 2 + (i != 0 ? 1 : 0) + (j != 0 ? 1 : 0) + (k != 0 ? 1 : 0)};
      }
  return steps;
}

}  // namespace

std::vector<std::uint8_t> surface_distance(const Image& labels, const Context& context) {
  const ImageGrid& grid = labels.grid;
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  const auto row = static_cast<std::ptrdiff_t>(grid.size[0]), layer = row * grid.size[1];
  std::vector<std::uint8_t> distance(voxels.size(), kFar);
  // The outermost voxels are empty by the voxelizer's contract and nobody asks for their distance: the masks
  // never reach beyond the image.
  const auto for_rows = [&](auto&& body) {
    for (int k = 1; k + 1 < grid.size[2]; ++k) {
      context.check_stop();
      for (int j = 1; j + 1 < grid.size[1]; ++j) body(static_cast<std::ptrdiff_t>(grid.offset(1, j, k)));
    }
  };
  const auto at = [](std::ptrdiff_t v) { return static_cast<std::size_t>(v); };
  for_rows([&](std::ptrdiff_t first) {
    for (std::ptrdiff_t v = first; v < first + row - 2; ++v) {
      const std::uint16_t label = voxels[at(v)];
      for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, row, layer})
        if (voxels[at(v - step)] != label || voxels[at(v + step)] != label) distance[at(v)] = kAtBoundary;
    }
  });
  const std::array<Step, 13> steps = steps_before(row, layer);
  const auto relax = [&](std::ptrdiff_t v, int direction) {
    int best = distance[at(v)];
    for (const Step& step : steps)
      best = std::min(best, distance[at(v + direction * step.offset)] + step.cost);
    distance[at(v)] = static_cast<std::uint8_t>(best);
  };
  for_rows([&](std::ptrdiff_t first) {
    for (std::ptrdiff_t v = first; v < first + row - 2; ++v) relax(v, 1);
  });
  for (int k = grid.size[2] - 2; k >= 1; --k) {
    context.check_stop();
    for (int j = grid.size[1] - 2; j >= 1; --j) {
      const auto first = static_cast<std::ptrdiff_t>(grid.offset(1, j, k));
      for (std::ptrdiff_t v = first + row - 3; v >= first; --v) relax(v, -1);
    }
  }
  return distance;
}

}  // namespace ecorche::tet
