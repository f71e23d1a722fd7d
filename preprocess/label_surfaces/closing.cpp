// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/closing.hpp"

#include <algorithm>
#include <vector>

#include "preprocess/label_surfaces/nearest.hpp"

namespace ecorche::label_surfaces {
namespace {

// Squared distance, mm^2, of every voxel's centre to the nearest one whose `inside` is `target`.
std::vector<float> squared_distance(const Mask& mask, std::uint8_t target,
                                    const std::array<double, 3>& spacing, const Context& context) {
  std::vector<float> d(mask.inside.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = mask.inside[i] == target ? 0 : kFar;
  std::vector<std::int32_t> untagged;
  spread_nearest(d, untagged, mask.size, spacing, context);
  return d;
}

// Gives every voxel that `from` reaches through faces, over voxels like it, the value `to`; how many.
std::size_t flood(Mask& mask, std::size_t start, std::uint8_t to, std::vector<std::size_t>& work) {
  const std::uint8_t from = mask.inside[start];
  const std::array<std::size_t, 4> step{1, mask.offset(0, 1, 0), mask.offset(0, 0, 1), mask.inside.size()};
  std::size_t count = 1;
  work.assign(1, start);
  mask.inside[start] = to;
  while (!work.empty()) {
    const std::size_t at = work.back();
    work.pop_back();
    const auto visit = [&](std::size_t next) {
      if (mask.inside[next] != from) return;
      mask.inside[next] = to;
      ++count;
      work.push_back(next);
    };
    for (std::size_t a = 0; a < 3; ++a) {
      if (at % step[a + 1] >= step[a]) visit(at - step[a]);
      if (at % step[a + 1] + step[a] < step[a + 1]) visit(at + step[a]);
    }
  }
  return count;
}

}  // namespace

void close_gaps(Mask& mask, const std::array<double, 3>& spacing, double radius_mm, const Context& context) {
  const auto limit = static_cast<float>(radius_mm * radius_mm);
  {
    const std::vector<float> d = squared_distance(mask, 1, spacing, context);
    for (std::size_t i = 0; i < d.size(); ++i) mask.inside[i] = d[i] <= limit ? 1 : 0;
  }
  const std::vector<float> d = squared_distance(mask, 0, spacing, context);
  // What was inside still is: nothing outside now lies within the radius of it.
  for (std::size_t i = 0; i < d.size(); ++i) mask.inside[i] = d[i] > limit ? 1 : 0;
}

void fill_hollows(Mask& mask) {
  constexpr std::uint8_t reached = 2;
  std::vector<std::size_t> work;
  flood(mask, 0, reached, work);  // the margin is outside and one piece
  for (std::uint8_t& voxel : mask.inside) voxel = voxel == reached ? 0 : 1;
}

void drop_specks(Mask& mask, double share) {
  constexpr std::uint8_t seen = 2;
  std::vector<std::size_t> work;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;  // a voxel of each, and how many it has
  std::size_t largest = 0;
  for (std::size_t i = 0; i < mask.inside.size(); ++i) {
    if (mask.inside[i] != 1) continue;
    pieces.emplace_back(i, flood(mask, i, seen, work));
    largest = std::max(largest, pieces.back().second);
  }
  for (const auto& [start, count] : pieces)
    flood(mask, start, static_cast<double>(count) < share * static_cast<double>(largest) ? 0 : 1, work);
}

}  // namespace ecorche::label_surfaces
