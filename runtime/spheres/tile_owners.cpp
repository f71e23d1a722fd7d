// SPDX-License-Identifier: Apache-2.0
// The proximity buffer: vectors of balls while cubes are halved, vectors of voxels in the smallest.
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
using Balls = hn::ScalableTag<std::int32_t>;
using BallVector = hn::Vec<Balls>;
// Two rows of a cube of 4, so that every instruction set finds whole vectors.
using Voxels = hn::CappedTag<std::int32_t, 8>;
using VoxelVector = hn::Vec<Voxels>;

constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
// Added to squared distances of bridges: more than any ball's.
constexpr std::int32_t kBehind = 1 << 30;

// Squares of the distances to the nearest and the farthest voxel of the cube, along one axis.
HWY_INLINE void add_squares(BallVector at, BallVector last, BallVector& least, BallVector& most) {
  const Balls d;
  const BallVector past = hn::Sub(at, last), before = hn::Neg(at);
  const BallVector near = hn::Max(hn::Max(past, before), hn::Zero(d));
  const BallVector far = hn::Max(at, hn::Neg(past));
  least = hn::Add(least, hn::Mul(near, near));
  most = hn::Add(most, hn::Mul(far, far));
}

}  // namespace

void narrow(CubeBalls& in, const std::array<std::int32_t, 3>& offset, std::int32_t edge, CubeBalls& out) {
  const Balls d;
  const std::size_t lanes = hn::Lanes(d);
  out.reserve(in.size);
  out.clear();
  out.bridges_from = in.bridges_from;
  const BallVector first_bridge = hn::Set(d, in.bridges_from), behind = hn::Set(d, kBehind);
  const auto penalty = [&](std::size_t b) HWY_ATTR {
    return hn::IfThenElseZero(hn::Not(hn::Lt(hn::LoadU(d, &in.row[b]), first_bridge)), behind);
  };
  const BallVector last = hn::Set(d, 16 * (edge - 1)), everything = hn::Set(d, kMost);
  const BallVector ox = hn::Set(d, 16 * offset[0]), oy = hn::Set(d, 16 * offset[1]),
                   oz = hn::Set(d, 16 * offset[2]);
  BallVector bound = everything;
  for (std::size_t b = 0; b < in.size; b += lanes) {
    BallVector least = hn::Zero(d), most = hn::Zero(d);
    add_squares(hn::Sub(hn::LoadU(d, &in.x[b]), ox), last, least, most);
    add_squares(hn::Sub(hn::LoadU(d, &in.y[b]), oy), last, least, most);
    add_squares(hn::Sub(hn::LoadU(d, &in.z[b]), oz), last, least, most);
    hn::StoreU(least, d, &in.least[b]);
    const auto whole = hn::And(hn::Lt(most, hn::LoadU(d, &in.limit[b])), hn::FirstN(d, in.size - b));
    bound = hn::Min(bound, hn::IfThenElse(whole, hn::Add(most, penalty(b)), everything));
  }
  bound = hn::MinOfLanes(d, bound);
  for (std::size_t b = 0; b < in.size; b += lanes) {
    const BallVector least = hn::LoadU(d, &in.least[b]), limit = hn::LoadU(d, &in.limit[b]);
    const auto kept =
        hn::And(hn::And(hn::Lt(least, limit), hn::Not(hn::Lt(bound, hn::Add(least, penalty(b))))),
                hn::FirstN(d, in.size - b));
    if (hn::AllFalse(d, kept)) continue;
    const std::size_t at = out.size;
    // Not CompressStore: its masked store is slow on some processors, and there is room beyond the end.
    const auto keep = [&](BallVector numbers, std::int32_t* to)
                          HWY_ATTR { hn::StoreU(hn::Compress(numbers, kept), d, to); };
    keep(hn::Sub(hn::LoadU(d, &in.x[b]), ox), &out.x[at]);
    keep(hn::Sub(hn::LoadU(d, &in.y[b]), oy), &out.y[at]);
    keep(hn::Sub(hn::LoadU(d, &in.z[b]), oz), &out.z[at]);
    keep(limit, &out.limit[at]);
    keep(hn::LoadU(d, &in.row[b]), &out.row[at]);
    out.size += hn::CountTrue(d, kept);
  }
}

// The squared distance of voxel (i, j, k) is 256 (i^2 + j^2 + k^2) + (x^2 + y^2 + z^2) - 32 (i x + j y + k
// z): what two balls differ by is linear, so a vector of voxels costs an addition. Rows ascend, so that the
// first of those as near stays.
bool draw(const CubeBalls& balls, TileOwners& out) {
  const Voxels d;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t vectors = kTileVoxels / lanes;
  HWY_ALIGN std::int32_t proximity[kTileVoxels];
  HWY_ALIGN std::int32_t square[kTileVoxels];
  const VoxelVector ones = hn::Set(d, kTileEdge - 1);
  for (std::size_t v = 0; v < vectors; ++v) {
    const VoxelVector at = hn::Iota(d, static_cast<std::int32_t>(v * lanes));
    const VoxelVector i = hn::And(at, ones), j = hn::And(hn::ShiftRight<2>(at), ones),
                      k = hn::ShiftRight<4>(at);
    const VoxelVector sum = hn::Add(hn::Add(hn::Mul(i, i), hn::Mul(j, j)), hn::Mul(k, k));
    hn::Store(hn::ShiftLeft<8>(sum), d, &square[v * lanes]);
    hn::Store(hn::Set(d, kMost), d, &proximity[v * lanes]);
    hn::Store(hn::Set(d, TileOwners::none), d, &out.owner[v * lanes]);
  }
  const std::size_t in_slice = 16 / lanes;
  for (std::size_t b = 0; b < balls.size; ++b) {
    const std::int32_t x = balls.x[b], y = balls.y[b], z = balls.z[b];
    const std::int32_t penalty = balls.row[b] < balls.bridges_from ? 0 : kBehind;
    const VoxelVector row = hn::Set(d, balls.row[b]), limit = hn::Set(d, balls.limit[b] + penalty);
    const VoxelVector dx = hn::Set(d, -32 * x), dy = hn::Set(d, -32 * y);
    for (std::size_t s = 0; s < in_slice; ++s) {
      const VoxelVector at = hn::Iota(d, static_cast<std::int32_t>(s * lanes));
      const VoxelVector i = hn::And(at, ones), j = hn::ShiftRight<2>(at);
      const VoxelVector flat =
          hn::Add(hn::Add(hn::Mul(i, dx), hn::Mul(j, dy)), hn::Set(d, x * x + y * y + z * z + penalty));
      for (std::size_t k = 0; k < kTileEdge; ++k) {
        const std::size_t voxel = 16 * k + s * lanes;
        const VoxelVector value = hn::Sub(flat, hn::Set(d, static_cast<std::int32_t>(32 * k) * z));
        const VoxelVector best = hn::Load(d, &proximity[voxel]);
        const auto taken =
            hn::And(hn::Lt(value, best), hn::Lt(value, hn::Sub(limit, hn::Load(d, &square[voxel]))));
        hn::Store(hn::IfThenElse(taken, value, best), d, &proximity[voxel]);
        hn::Store(hn::IfThenElse(taken, row, hn::Load(d, &out.owner[voxel])), d, &out.owner[voxel]);
      }
    }
  }
  VoxelVector least = hn::Set(d, kMost);
  for (std::size_t v = 0; v < vectors; ++v) least = hn::Min(least, hn::Load(d, &proximity[v * lanes]));
  return hn::GetLane(hn::MinOfLanes(d, least)) < kMost;
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime {

namespace {

// The longest vector of any processor that Highway knows is 2048 bits here.
constexpr std::size_t kBeyond = 64;

}  // namespace

void CubeBalls::reserve(std::size_t count) {
  if (row.size() >= count + kBeyond) return;
  const std::size_t room = 2 * count + kBeyond;
  for (auto* array : {&x, &y, &z, &limit, &row, &least}) array->resize(room);
}

void CubeBalls::push(std::int32_t x_, std::int32_t y_, std::int32_t z_, std::int32_t limit_,
                     std::int32_t row_) {
  reserve(size + 1);
  x[size] = x_, y[size] = y_, z[size] = z_, limit[size] = limit_, row[size] = row_;
  ++size;
}

namespace kernels {

HWY_EXPORT(narrow);
HWY_EXPORT(draw);

void narrow(CubeBalls& in, const std::array<std::int32_t, 3>& offset, std::int32_t edge, CubeBalls& out) {
  HWY_DYNAMIC_DISPATCH(narrow)(in, offset, edge, out);
}

bool draw(const CubeBalls& balls, TileOwners& out) {
  return HWY_DYNAMIC_DISPATCH(draw)(balls, out);
}

}  // namespace kernels

}  // namespace ecorche::runtime
#endif
