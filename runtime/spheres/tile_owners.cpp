// SPDX-License-Identifier: Apache-2.0
// The proximity buffer of a tile, a row of voxels at a time.
#include "runtime/spheres/tile_owners.hpp"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/spheres/tile_owners.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<std::int32_t, kTileEdge>;
using Vector = hn::Vec<Lanes>;

}  // namespace

// With i the voxel's place in its row, the squared distance is 256 i^2 - 32 i x + (x^2 + y^2 + z^2): what two
// balls differ by is linear in i, so a row costs an addition.
void draw(std::span<const TileBall> balls, TileOwners& out) {
  const Lanes d;
  constexpr std::int32_t kStep = 16;
  const std::size_t lanes = hn::Lanes(d);
  for (const TileBall& ball : balls) {
    const Vector row = hn::Set(d, ball.row);
    for (std::size_t first = 0; first < kTileEdge; first += lanes) {
      const Vector i = hn::Iota(d, static_cast<std::int32_t>(first));
      const Vector slope = hn::Mul(i, hn::Set(d, -2 * kStep * ball.x));
      const Vector limit = hn::Sub(hn::Set(d, ball.limit), hn::Mul(hn::Mul(i, i), hn::Set(d, kStep * kStep)));
      for (std::int32_t k = 0; k < kTileEdge; ++k) {
        const std::int32_t dz = kStep * k - ball.z;
        if (dz * dz >= ball.limit) continue;
        for (std::int32_t j = 0; j < kTileEdge; ++j) {
          const std::int32_t dy = kStep * j - ball.y;
          const std::int32_t aside = dz * dz + dy * dy;
          if (aside >= ball.limit) continue;
          const Vector value = hn::Add(slope, hn::Set(d, aside + ball.x * ball.x));
          const std::size_t at = first + static_cast<std::size_t>(kTileEdge * (j + kTileEdge * k));
          const Vector best = hn::Load(d, &out.proximity[at]);
          const Vector owner = hn::Load(d, &out.owner[at]);
          const auto nearer = hn::Or(hn::Lt(value, best), hn::And(hn::Eq(value, best), hn::Lt(row, owner)));
          const auto taken = hn::And(nearer, hn::Lt(value, limit));
          hn::Store(hn::IfThenElse(taken, value, best), d, &out.proximity[at]);
          hn::Store(hn::IfThenElse(taken, row, owner), d, &out.owner[at]);
        }
      }
    }
  }
}

std::int32_t farthest(const TileOwners& tile) {
  const Lanes d;
  Vector most = hn::Zero(d);
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t first = 0; first < kTileEdge; first += lanes) {
    const Vector i = hn::Iota(d, static_cast<std::int32_t>(first));
    const Vector square = hn::Mul(hn::Mul(i, i), hn::Set(d, 256));
    const Vector none = hn::Set(d, std::numeric_limits<std::int32_t>::max());
    for (std::size_t at = first; at < kTileVoxels; at += kTileEdge) {
      const Vector value = hn::Load(d, &tile.proximity[at]);
      most = hn::Max(most, hn::IfThenElse(hn::Eq(value, none), none, hn::Add(value, square)));
    }
  }
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime {
namespace kernels {

HWY_EXPORT(draw);
HWY_EXPORT(farthest);

void draw(std::span<const TileBall> balls, TileOwners& out) {
  HWY_DYNAMIC_DISPATCH(draw)(balls, out);
}

std::int32_t farthest(const TileOwners& tile) {
  return HWY_DYNAMIC_DISPATCH(farthest)(tile);
}

void clear(TileOwners& out) {
  out.proximity.fill(std::numeric_limits<std::int32_t>::max());
  out.owner.fill(TileOwners::none);
}

}  // namespace kernels

namespace {

// So many balls are drawn between two looks at what is still open.
constexpr std::size_t kBatch = 8;

std::int32_t most_of(const TileBall& ball) {
  const auto far = [](std::int32_t at) { return std::max(at, 16 * (kTileEdge - 1) - at); };
  const std::int32_t x = far(ball.x), y = far(ball.y), z = far(ball.z);
  return x * x + y * y + z * z;
}

}  // namespace

bool draw_tile(std::vector<TileBall>& balls, TileOwners& out) {
  kernels::clear(out);
  // A ball that holds the whole tile bounds every voxel's distance: what is farther never counts.
  std::int32_t bound = std::numeric_limits<std::int32_t>::max();
  for (const TileBall& ball : balls) {
    const std::int32_t most = most_of(ball);
    if (most < ball.limit) bound = std::min(bound, most);
  }
  std::erase_if(balls, [bound](const TileBall& ball) { return ball.least > bound; });
  std::sort(balls.begin(), balls.end(), [](const TileBall& a, const TileBall& b) {
    return a.least != b.least ? a.least < b.least : a.row < b.row;
  });
  for (std::size_t first = 0; first < balls.size(); first += kBatch) {
    if (first > 0) bound = std::min(bound, kernels::farthest(out));
    if (balls[first].least > bound) break;
    kernels::draw(std::span(balls).subspan(first, std::min(kBatch, balls.size() - first)), out);
  }
  return std::any_of(out.owner.begin(), out.owner.end(),
                     [](std::int32_t o) { return o != TileOwners::none; });
}

}  // namespace ecorche::runtime
#endif
