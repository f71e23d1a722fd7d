// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/owners.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "core/values/error.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kMostVoxels = 2147483648.0;
// Centres stay within what a 32-bit number of voxels holds with room for every sum.
constexpr double kFarthest = 1e6;

// A ball in sixteenths of a voxel from the box's first voxel.
struct FixedBall {
  std::array<std::int64_t, 3> centre;
  std::int32_t limit;
  std::array<std::int32_t, 3> low,
      high;  // voxels of the box that it may hold, both ends included, cut to the box
};

[[noreturn]] void bad(std::size_t row, const std::string& what) {
  throw Error(ErrorKind::data, "ball " + std::to_string(row), what, "check the pose and the skeleton");
}

void check(const Ball& ball, std::size_t row) {
  for (const double x : ball.centre) {
    if (!(std::abs(x) < kFarthest)) bad(row, "it lies more than a million voxels away");
  }
  if (!(ball.radius2 <= kMostRadius * kMostRadius)) {
    bad(row, "its radius is more than " + std::to_string(static_cast<int>(kMostRadius)) + " voxels");
  }
}

std::int64_t floor_div(std::int64_t a, std::int64_t b) {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

// Rounded in the lattice, so that the box has no say.
std::int64_t sixteenths(double x) {
  return static_cast<std::int64_t>(std::floor(16 * x + 0.5));
}

// What rounding leaves of 256 r^2, a whole number where the lattice is the skeleton's, is not counted.
std::int32_t limit_of(double radius2) {
  return static_cast<std::int32_t>(std::ceil(256 * radius2 - 1e-6));
}

// Every offset from the centre of a voxel that the ball holds is at most this, sixteenths.
std::int64_t reach_of(std::int32_t limit) {
  return limit <= 0 ? -1 : static_cast<std::int64_t>(std::sqrt(static_cast<double>(limit - 1)));
}

// False where the ball holds nothing of the box.
bool fix(const Ball& ball, const LatticeBox& box, FixedBall& out) {
  out.limit = limit_of(ball.radius2);
  const std::int64_t reach = reach_of(out.limit);
  if (reach < 0) return false;
  for (std::size_t a = 0; a < 3; ++a) {
    out.centre[a] = sixteenths(ball.centre[a]) - 16 * std::int64_t{box.first[a]};
    const std::int64_t low = -floor_div(reach - out.centre[a], 16),
                       high = floor_div(out.centre[a] + reach, 16);
    out.low[a] = static_cast<std::int32_t>(std::max<std::int64_t>(low, 0));
    out.high[a] = static_cast<std::int32_t>(std::min<std::int64_t>(high, box.size[a] - 1));
    if (out.low[a] > out.high[a]) return false;
  }
  return true;
}

std::int32_t tiles_along(std::int32_t voxels) {
  return (voxels + kTileEdge - 1) / kTileEdge;
}

using Rows = std::vector<std::int32_t>;

// As the tile at `first` sees the ball; false where it holds nothing of it.
bool seen_from(const FixedBall& ball, std::int32_t row, const std::array<std::int32_t, 3>& first,
               TileBall& out) {
  std::array<std::int64_t, 3> at{};
  std::int64_t least = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    at[a] = ball.centre[a] - 16 * std::int64_t{first[a]};
    const std::int64_t beyond = at[a] < 0 ? -at[a] : std::max<std::int64_t>(at[a] - 16 * (kTileEdge - 1), 0);
    least += beyond * beyond;
  }
  if (least >= ball.limit) return false;
  out = {static_cast<std::int32_t>(at[0]),
         static_cast<std::int32_t>(at[1]),
         static_cast<std::int32_t>(at[2]),
         ball.limit,
         row,
         static_cast<std::int32_t>(least)};
  return true;
}

// The balls of every slab of tiles along `axis`, rows ascending.
std::vector<Rows> in_slabs(const std::vector<FixedBall>& balls, std::int32_t slabs, std::size_t axis) {
  std::vector<Rows> out(static_cast<std::size_t>(slabs));
  for (std::size_t b = 0; b < balls.size(); ++b) {
    if (balls[b].limit <= 0) continue;
    for (std::int32_t s = balls[b].low[axis] / kTileEdge; s <= balls[b].high[axis] / kTileEdge; ++s) {
      out[static_cast<std::size_t>(s)].push_back(static_cast<std::int32_t>(b));
    }
  }
  return out;
}

// One thread's storage.
struct Scratch {
  Rows row;
  std::vector<TileBall> tile;
  TileOwners owners;
};

void draw_row(const std::vector<FixedBall>& balls, const Rows& slab, const LatticeBox& box, std::int32_t j,
              std::int32_t k, Scratch& scratch, const std::function<void(const Tile&)>& f) {
  scratch.row.clear();
  for (const std::int32_t b : slab) {
    const FixedBall& ball = balls[static_cast<std::size_t>(b)];
    if (ball.low[1] < j + kTileEdge && ball.high[1] >= j) scratch.row.push_back(b);
  }
  if (scratch.row.empty()) return;
  for (std::int32_t i = 0; i < box.size[0]; i += kTileEdge) {
    scratch.tile.clear();
    TileBall seen{};
    for (const std::int32_t b : scratch.row) {
      const FixedBall& ball = balls[static_cast<std::size_t>(b)];
      if (ball.low[0] >= i + kTileEdge || ball.high[0] < i) continue;
      if (seen_from(ball, b, {i, j, k}, seen)) scratch.tile.push_back(seen);
    }
    if (scratch.tile.empty() || !draw_tile(scratch.tile, scratch.owners)) continue;
    f({{i, j, k},
       {std::min(kTileEdge, box.size[0] - i), std::min(kTileEdge, box.size[1] - j),
        std::min(kTileEdge, box.size[2] - k)},
       &scratch.owners});
  }
}

}  // namespace

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
  if (voxels > kMostVoxels) {
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
               const std::function<void(const Tile&)>& f) {
  std::vector<FixedBall> balls(set.balls.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, balls.size(), 4096), [&](const auto& range) {
    for (std::size_t b = range.begin(); b < range.end(); ++b) {
      check(set.balls[b], b);
      if (!fix(set.balls[b], box, balls[b])) balls[b].limit = 0;
    }
  });
  const std::vector<Rows> slabs = in_slabs(balls, tiles_along(box.size[2]), 2);
  tbb::enumerable_thread_specific<Scratch> storage;
  const std::int32_t across = tiles_along(box.size[1]);
  std::atomic<std::int64_t> done{0};
  const std::int64_t all = std::int64_t{across} * static_cast<std::int64_t>(slabs.size());
  tbb::parallel_for(std::int64_t{0}, all, [&](std::int64_t task) {
    if (context.stop.stop_requested()) return;
    const auto slab = static_cast<std::size_t>(task / across);
    draw_row(balls, slabs[slab], box, static_cast<std::int32_t>(task % across) * kTileEdge,
             static_cast<std::int32_t>(slab) * kTileEdge, storage.local(), f);
    const std::int64_t now = ++done;
    if (now % 64 == 0) context.report(static_cast<double>(now) / static_cast<double>(all));
  });
  context.check_stop();
}

}  // namespace ecorche::runtime
