// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/tears.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/spheres/coverage.hpp"

namespace ecorche::runtime {
namespace {

// The covered voxels of a box; beyond it nothing is.
struct Cover {
  explicit Cover(const BallSet& set, const Context& context)
      : box(grown_box(set)), mask(runtime::covered(set, box, context)) {}

  bool at(std::int64_t i, std::int64_t j, std::int64_t k) const {
    const std::int64_t x = i - box.first[0], y = j - box.first[1], z = k - box.first[2];
    if (x < 0 || y < 0 || z < 0 || x >= box.size[0] || y >= box.size[1] || z >= box.size[2]) return false;
    return mask.scalars<std::uint8_t>()[mask.grid.offset(static_cast<int>(x), static_cast<int>(y),
                                                         static_cast<int>(z))] != 0;
  }
  // A place is covered when one of the eight voxels around it is: rounding must not look like a tear.
  bool near(const Vec3& p) const {
    const auto i = static_cast<std::int64_t>(std::floor(p[0])),
               j = static_cast<std::int64_t>(std::floor(p[1])),
               k = static_cast<std::int64_t>(std::floor(p[2]));
    for (int c = 0; c < 8; ++c) {
      if (at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))) return true;
    }
    return false;
  }

  LatticeBox box;
  Image mask;
};

// Where the ball that owned the voxel at rest takes it.
Vec3 posed_place(const BallSet& set, std::int32_t row, const std::array<std::int32_t, 3>& voxel) {
  const Ball& ball = set.balls[static_cast<std::size_t>(row)];
  const auto& r = set.back[static_cast<std::size_t>(ball.motion)];
  const double dx = voxel[0] - ball.rest[0], dy = voxel[1] - ball.rest[1], dz = voxel[2] - ball.rest[2];
  // `back` is a rotation: its transpose goes forth.
  return {ball.centre[0] + r[0] * dx + r[3] * dy + r[6] * dz,
          ball.centre[1] + r[1] * dx + r[4] * dy + r[7] * dz,
          ball.centre[2] + r[2] * dx + r[5] * dy + r[8] * dz};
}

// Every voxel step between the two places, the ends left out.
bool torn(const Cover& cover, const Vec3& a, const Vec3& b) {
  double length2 = 0;
  for (std::size_t i = 0; i < 3; ++i) length2 += (b[i] - a[i]) * (b[i] - a[i]);
  const int steps = static_cast<int>(std::ceil(std::sqrt(std::min(length2, 1e8))));
  for (int s = 1; s < steps; ++s) {
    const double t = static_cast<double>(s) / steps;
    if (!cover.near({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])}))
      return true;
  }
  return false;
}

template <class F>
std::size_t count_if(std::size_t size, F&& holds) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, size, 4096), std::size_t{0},
      [&](const auto& range, std::size_t sum) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) sum += holds(i);
        return sum;
      },
      std::plus<>());
}

}  // namespace

TearDetector::TearDetector(const BallSet& rest, const std::vector<std::int32_t>& segment,
                           const Context& context) {
  const LatticeBox box = grown_box(rest);
  const ImageGrid grid = grid_of(rest.lattice, box);
  const std::vector<std::int32_t> owner = owners_of(rest, box, context);
  const auto held = [&](std::int32_t i, std::int32_t j, std::int32_t k) {
    return i >= 0 && j >= 0 && k >= 0 && i < grid.size[0] && j < grid.size[1] && k < grid.size[2] &&
           owner[grid.offset(i, j, k)] != TileOwners::none;
  };
  constexpr std::array<std::array<std::int32_t, 3>, 6> kSteps{
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  std::vector<std::uint32_t> row(grid.voxels(), 0);  // of deep_, from 1
  for (std::int32_t k = 0; k < grid.size[2]; ++k) {
    for (std::int32_t j = 0; j < grid.size[1]; ++j) {
      for (std::int32_t i = 0; i < grid.size[0]; ++i) {
        if (!held(i, j, k)) continue;
        const bool deep = std::all_of(kSteps.begin(), kSteps.end(), [&](const auto& s) {
          return held(i + s[0], j + s[1], k + s[2]) && held(i + 2 * s[0], j + 2 * s[1], k + 2 * s[2]);
        });
        if (!deep) continue;
        const std::size_t at = grid.offset(i, j, k);
        deep_.push_back({{box.first[0] + i, box.first[1] + j, box.first[2] + k}, owner[at]});
        row[at] = static_cast<std::uint32_t>(deep_.size());
        const std::array<std::size_t, 3> before{i > 0 ? at - 1 : at, j > 0 ? grid.offset(i, j - 1, k) : at,
                                                k > 0 ? grid.offset(i, j, k - 1) : at};
        for (const std::size_t other : before) {
          if (other == at || row[other] == 0) continue;
          if (segment[static_cast<std::size_t>(owner[at])] == segment[static_cast<std::size_t>(owner[other])])
            continue;
          links_.push_back({row[other] - 1, row[at] - 1});
        }
      }
    }
  }
  rest_parts_ = parts_of(covered(rest, box, context), Tears::least_part, Gap::one_voxel);
}

Tears TearDetector::look(const BallSet& posed, const Context& context) const {
  const Cover cover(posed, context);
  const auto place = [&](const Deep& deep) { return posed_place(posed, deep.ball, deep.voxel); };
  Tears out;
  out.rest_parts = rest_parts_;
  out.uncovered = count_if(deep_.size(), [&](std::size_t i) { return !cover.near(place(deep_[i])); });
  std::vector<std::uint8_t> is_torn(links_.size());
  out.links = count_if(links_.size(), [&](std::size_t i) {
    is_torn[i] = torn(cover, place(deep_[links_[i].a]), place(deep_[links_[i].b]));
    return is_torn[i] != 0;
  });
  std::map<std::array<std::int32_t, 2>, std::size_t> by_pair;
  std::size_t most = 0;
  for (std::size_t i = 0; out.links > 0 && i < links_.size(); ++i) {
    if (is_torn[i] == 0) continue;
    const auto segment = [&](std::uint32_t row) {
      return posed.balls[static_cast<std::size_t>(deep_[row].ball)].motion;
    };
    const auto [low, high] = std::minmax({segment(links_[i].a), segment(links_[i].b)});
    const std::size_t now = ++by_pair[{low, high}];
    if (now <= most) continue;
    most = now;
    out.between = {low, high};
  }
  out.parts = parts_of(cover.mask, Tears::least_part, Gap::one_voxel);
  return out;
}

}  // namespace ecorche::runtime
