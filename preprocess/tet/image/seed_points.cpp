// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/image/seed_points.hpp"

#include <cmath>
#include <unordered_map>

namespace ecorche::tet {
namespace {

constexpr std::int32_t kSmallPart = 64;  // voxels

/// Connected parts of equal labels; background is -1.
struct Parts {
  std::vector<std::int32_t> of_voxel;
  std::vector<std::int32_t> voxels;  // of each part
};

Parts find_parts(const ImageGrid& grid, std::span<const std::uint16_t> labels, const Context& context) {
  Parts parts;
  parts.of_voxel.assign(labels.size(), -1);
  const auto row = static_cast<std::size_t>(grid.size[0]),
             layer = row * static_cast<std::size_t>(grid.size[1]);
  std::vector<std::size_t> queue;
  for (std::size_t start = 0; start < labels.size(); ++start) {
    if (labels[start] == 0 || parts.of_voxel[start] >= 0) continue;
    const auto part = static_cast<std::int32_t>(parts.voxels.size());
    parts.of_voxel[start] = part;
    queue.assign(1, start);
    for (std::size_t n = 0; n < queue.size(); ++n) {
      if ((n & 0xffff) == 0) context.check_stop();
      // Labelled voxels lie inside the image's empty rim, so that all neighbours exist.
      for (const std::size_t step : {std::size_t{1}, row, layer})
        for (const std::size_t other : {queue[n] - step, queue[n] + step})
          if (labels[other] == labels[start] && parts.of_voxel[other] < 0) {
            parts.of_voxel[other] = part;
            queue.push_back(other);
          }
    }
    parts.voxels.push_back(static_cast<std::int32_t>(queue.size()));
  }
  return parts;
}

using Cell = std::array<std::int32_t, 4>;  // part, and a cell of `apart` mm

struct HashCell {
  std::size_t operator()(const Cell& c) const {
    std::size_t hash = 0;
    for (const std::int32_t x : c) hash = hash * 0x9e3779b97f4a7c15ULL + static_cast<std::uint32_t>(x);
    return hash ^ hash >> 32;
  }
};

/// Points that keep a distance from one another, part by part.
class Spread {
 public:
  explicit Spread(double apart) : apart_(apart) {}

  bool add(std::int32_t part, const std::array<double, 3>& p) {
    Cell home{part, 0, 0, 0};
    for (std::size_t axis = 0; axis < 3; ++axis)
      home[axis + 1] = static_cast<std::int32_t>(std::floor(p[axis] / apart_));
    for (int n = 0; n < 27; ++n) {
      const Cell near{part, home[1] + n % 3 - 1, home[2] + n / 3 % 3 - 1, home[3] + n / 9 - 1};
      const auto found = cells_.find(near);
      if (found == cells_.end()) continue;
      for (const std::array<double, 3>& q : found->second) {
        const double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
        if (x * x + y * y + z * z < apart_ * apart_) return false;
      }
    }
    cells_[home].push_back(p);
    return true;
  }

 private:
  double apart_;
  std::unordered_map<Cell, std::vector<std::array<double, 3>>, HashCell> cells_;
};

}  // namespace

std::vector<BoundaryStep> seed_steps(const Image& labels, double apart, const Context& context) {
  const ImageGrid& grid = labels.grid;
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  const Parts parts = find_parts(grid, voxels, context);
  Spread spread(apart);
  std::vector<BoundaryStep> steps;
  constexpr std::array<std::array<int, 3>, 6> kTowards{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  for (int k = 1; k + 1 < grid.size[2]; ++k) {
    context.check_stop();
    for (int j = 1; j + 1 < grid.size[1]; ++j)
      for (int i = 1; i + 1 < grid.size[0]; ++i) {
        const std::size_t voxel = grid.offset(i, j, k);
        if (voxels[voxel] == 0) continue;
        const std::int32_t part = parts.of_voxel[voxel];
        const bool small = parts.voxels[static_cast<std::size_t>(part)] <= kSmallPart;
        for (const auto& d : kTowards) {
          if (voxels[grid.offset(i + d[0], j + d[1], k + d[2])] == voxels[voxel]) continue;
          const std::array<double, 3> face = grid.point(i + 0.5 * d[0], j + 0.5 * d[1], k + 0.5 * d[2]);
          if (small || spread.add(part, face))
            steps.push_back({grid.point(i, j, k), grid.point(i + d[0], j + d[1], k + d[2])});
        }
      }
  }
  return steps;
}

}  // namespace ecorche::tet
