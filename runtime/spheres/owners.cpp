// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/owners.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/fixed_ball.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kMostOwned = 2147483648.0;
// Centres stay within what a 32-bit number of voxels holds with room for every sum.
constexpr double kFarthest = 1e6;

[[noreturn]] void bad(std::size_t row, const std::string& what) {
  throw Error(ErrorKind::data, "ball " + std::to_string(row), what, "check the pose and the skeleton");
}

// The first cubes.
constexpr std::int32_t kCube = 16;

std::int32_t cubes_along(std::int32_t voxels) {
  return (voxels + kCube - 1) / kCube;
}

using Rows = std::vector<std::int32_t>;

// The balls of every row of cubes along the first axis, rows of balls ascending: what one task looks at.
struct CubeRows {
  std::int32_t across, slabs;      // rows along the second and third axis
  std::vector<std::size_t> first;  // of every row of cubes, and one more
  Rows balls;

  CubeRows(const std::vector<FixedBall>& all, const LatticeBox& box)
      : across(cubes_along(box.size[1])), slabs(cubes_along(box.size[2])) {
    first.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(slabs) + 1, 0);
    for (const FixedBall& ball : all) each(ball, [&](std::size_t row) { ++first[row + 1]; });
    for (std::size_t row = 1; row < first.size(); ++row) first[row] += first[row - 1];
    balls.resize(first.back());
    std::vector<std::size_t> at(first.begin(), first.end() - 1);
    for (std::size_t b = 0; b < all.size(); ++b)
      each(all[b], [&](std::size_t row) { balls[at[row]++] = static_cast<std::int32_t>(b); });
  }

  std::size_t count() const { return first.size() - 1; }
  std::span<const std::int32_t> of(std::size_t row) const {
    return {balls.data() + first[row], first[row + 1] - first[row]};
  }

 private:
  template <class F>
  void each(const FixedBall& ball, F&& f) const {
    if (ball.limit <= 0) return;
    for (std::int32_t s = ball.low[2] / kCube; s <= ball.high[2] / kCube; ++s) {
      for (std::int32_t j = ball.low[1] / kCube; j <= ball.high[1] / kCube; ++j)
        f(static_cast<std::size_t>(j) + static_cast<std::size_t>(across) * static_cast<std::size_t>(s));
    }
  }
};

// One thread's work on one box.
class Descent {
 public:
  Descent(const std::vector<FixedBall>& balls, const LatticeBox& box, const BrickMask& mask,
          std::int32_t bridges_from, const std::function<void(const Tile&)>& f)
      : balls_(balls),
        box_(box),
        mask_(mask),
        f_(f),
        cubes_(static_cast<std::size_t>(cubes_along(box.size[0]))) {
    for (CubeBalls& cube : cubes_) cube.bridges_from = bridges_from;
  }

  // The cubes of a row along i.
  void row(std::span<const std::int32_t> row, std::int32_t j, std::int32_t k) {
    if (row.empty()) return;
    for (CubeBalls& cube : cubes_) cube.clear();
    for (const std::int32_t b : row) {
      const FixedBall& ball = balls_[static_cast<std::size_t>(b)];
      const auto seen = [&](std::size_t a, std::int32_t first) {
        return static_cast<std::int32_t>(ball.centre[a] - 16 * std::int64_t{first});
      };
      const std::int32_t y = seen(1, j), z = seen(2, k);
      for (std::int32_t c = ball.low[0] / kCube; c <= ball.high[0] / kCube; ++c)
        cubes_[static_cast<std::size_t>(c)].push(seen(0, kCube * c), y, z, ball.limit, b);
    }
    for (std::size_t c = 0; c < cubes_.size(); ++c) {
      const std::int32_t i = kCube * static_cast<std::int32_t>(c);
      if (cubes_[c].size == 0 || (mask_ && !mask_.has(i, j, k))) continue;
      kernels::narrow(cubes_[c], {0, 0, 0}, kCube, level_[0]);
      halve(0, kCube, {i, j, k});
    }
  }

 private:
  // `level_[depth]` are the balls of the cube of `edge` voxels at `first`.
  void halve(std::size_t depth, std::int32_t edge, const std::array<std::int32_t, 3>& first) {
    if (level_[depth].size == 0) return;
    if (edge == kTileEdge) {
      if (!kernels::draw(level_[depth], owners_)) return;
      Tile tile{first, {}, &owners_};
      for (std::size_t a = 0; a < 3; ++a) tile.size[a] = std::min(kTileEdge, box_.size[a] - first[a]);
      return f_(tile);
    }
    const std::int32_t half = edge / 2;
    for (int eighth = 0; eighth < 8; ++eighth) {
      const std::array<std::int32_t, 3> offset{half * (eighth & 1), half * (eighth >> 1 & 1),
                                               half * (eighth >> 2)};
      const std::array<std::int32_t, 3> at{first[0] + offset[0], first[1] + offset[1], first[2] + offset[2]};
      if (at[0] >= box_.size[0] || at[1] >= box_.size[1] || at[2] >= box_.size[2]) continue;
      kernels::narrow(level_[depth], offset, half, level_[depth + 1]);
      halve(depth + 1, half, at);
    }
  }

  const std::vector<FixedBall>& balls_;
  const LatticeBox& box_;
  const BrickMask& mask_;
  const std::function<void(const Tile&)>& f_;
  std::vector<CubeBalls> cubes_;
  std::array<CubeBalls, 3> level_;
  TileOwners owners_;
};

}  // namespace

void check(const Ball& ball, std::size_t row) {
  for (const double x : ball.centre) {
    if (!(std::abs(x) < kFarthest)) bad(row, "it lies more than a million voxels away");
  }
  if (!(ball.radius2 <= kMostRadius * kMostRadius)) {
    bad(row, "its radius is more than " + std::to_string(static_cast<int>(kMostRadius)) + " voxels");
  }
}

ImageGrid grid_of(const ImageGrid& lattice, const LatticeBox& box) {
  ImageGrid grid = lattice;
  grid.size = box.size;
  if (box.first != std::array<std::int32_t, 3>{0, 0, 0}) {
    grid.origin = lattice.point(box.first[0], box.first[1], box.first[2]);
  }
  return grid;
}

LatticeBox grown_box(const BallSet& set) {
  std::array<std::int64_t, 3> low{0, 0, 0},
      high{set.lattice.size[0] - 1, set.lattice.size[1] - 1, set.lattice.size[2] - 1};
  for (std::size_t b = 0; b < set.balls.size(); ++b) {
    const Ball& ball = set.balls[b];
    check(ball, b);
    const std::int64_t reach = reach_of(limit_of(ball.radius2));
    if (reach < 0) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t centre = sixteenths(ball.centre[a]);
      low[a] = std::min(low[a], -floor_div(reach - centre, 16));
      high[a] = std::max(high[a], floor_div(centre + reach, 16));
    }
  }
  LatticeBox box;
  double voxels = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    box.first[a] = static_cast<std::int32_t>(low[a]);
    box.size[a] = static_cast<std::int32_t>(high[a] - low[a] + 1);
    voxels *= box.size[a];
  }
  if (voxels > kMostOwned) {
    throw Error(ErrorKind::data, "posed volume", "the posed body needs more than 2^31 voxels",
                "use a region, coarser voxels, or a pose nearer to the scanned place");
  }
  return box;
}

LatticeBox box_within(const ImageGrid& lattice, const Vec3& low, const Vec3& high) {
  Vec3 from{1e9, 1e9, 1e9}, to{-1e9, -1e9, -1e9};
  // The corners of the LPS box bound it along any axes.
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at = lattice.index(
        {corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1], corner & 4 ? high[2] : low[2]});
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = std::min(from[a], at[a]);
      to[a] = std::max(to[a], at[a]);
    }
  }
  LatticeBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const double first = std::ceil(std::max(from[a], -kFarthest) - 1e-6);
    const double last = std::floor(std::min(to[a], kFarthest) + 1e-6);
    box.first[a] = static_cast<std::int32_t>(first);
    box.size[a] = static_cast<std::int32_t>(std::max(last - first + 1, 0.0));
  }
  return box;
}

void for_tiles(const BallSet& set, const LatticeBox& box, const Context& context,
               const std::function<void(const Tile&)>& f, const BrickMask& mask) {
  std::vector<FixedBall> balls(set.balls.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, balls.size(), 4096), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      check(set.balls[b], b);
      if (!fix(set.balls[b], box, balls[b])) balls[b].limit = 0;
    }
  });
  const CubeRows rows(balls, box);
  tbb::enumerable_thread_specific<Descent> descents(
      [&] { return Descent(balls, box, mask, set.bridges_from, f); });
  std::atomic<std::int64_t> done{0};
  const auto all = static_cast<std::int64_t>(rows.count());
  tbb::parallel_for(std::int64_t{0}, all, [&](std::int64_t task) {
    if (context.stop.stop_requested()) return;
    descents.local().row(rows.of(static_cast<std::size_t>(task)),
                         static_cast<std::int32_t>(task % rows.across) * kCube,
                         static_cast<std::int32_t>(task / rows.across) * kCube);
    const std::int64_t now = ++done;
    if (now % 64 == 0) context.report(static_cast<double>(now) / static_cast<double>(all));
  });
  context.check_stop();
}

std::vector<std::int32_t> owners_of(const BallSet& set, const LatticeBox& box, const Context& context) {
  const ImageGrid grid = grid_of(set.lattice, box);
  std::vector<std::int32_t> out(grid.voxels(), TileOwners::none);
  for_tiles(set, box, context, [&](const Tile& tile) {
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t row) {
      out[grid.offset(i, j, k)] = row;
    });
  });
  return out;
}

}  // namespace ecorche::runtime
