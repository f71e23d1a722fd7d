// SPDX-License-Identifier: Apache-2.0
// Boxes of whole voxels: of runs of tets, and of those that lie the wrong way round.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/run_boxes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/draw_tets.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

// Lowest and highest x, y, z of nodes; `rows` as TetPalettes fills them up.
struct Bounds {
  HWY_ALIGN std::int32_t low[4], high[4];
};

HWY_INLINE void bound(const std::int32_t* places, const std::uint32_t* rows, std::size_t count, Bounds& out) {
#if HWY_TARGET == HWY_SCALAR
  std::copy_n(places + rows[0], 3, out.low);
  std::copy_n(places + rows[0], 3, out.high);
  for (std::size_t i = 1; i < count; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      out.low[a] = std::min(out.low[a], places[rows[i] + a]);
      out.high[a] = std::max(out.high[a], places[rows[i] + a]);
    }
  }
#else
  // The fourth number is the neighbour's, and nobody's business.
  const hn::FixedTag<std::int32_t, 4> d;
  static_assert(TetPalettes::fill % 2 == 0);
  auto low = hn::LoadU(d, places + rows[0]), high = low, other_low = low, other_high = low;
  for (std::size_t i = 0; i < count; i += 2) {
    const auto one = hn::LoadU(d, places + rows[i]), other = hn::LoadU(d, places + rows[i + 1]);
    low = hn::Min(low, one);
    high = hn::Max(high, one);
    other_low = hn::Min(other_low, other);
    other_high = hn::Max(other_high, other);
  }
  hn::Store(hn::Min(low, other_low), d, out.low);
  hn::Store(hn::Max(high, other_high), d, out.high);
#endif
}

void box_runs(const DrawTets& job, const VoxelRange& range, std::size_t first, std::span<VoxelRange> boxes) {
  constexpr std::size_t ahead = 4;
  const TetPalettes& palettes = job.palettes;
  const std::int32_t less_than_one = (1 << job.bits) - 1;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const std::size_t run = first + i, next = run + ahead;
    if (next < palettes.runs()) ask_for(job.posed.data(), palettes.rows(next), palettes.filled(next), 2);
    Bounds bounds;
    bound(job.posed.data(), palettes.rows(run), palettes.filled(run), bounds);
    VoxelRange& box = boxes[i];
    for (std::size_t a = 0; a < 3; ++a) {
      box.first[a] = std::max((bounds.low[a] + less_than_one) >> job.bits, range.first[a]);
      box.last[a] = std::min(bounds.high[a] >> job.bits, range.last[a]);
    }
    if (box.empty() || (job.only && !job.only.meets(box.first, box.last))) box = VoxelRange::nothing();
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime {
namespace kernels {

HWY_EXPORT(box_runs);

void box_runs(const DrawTets& job, const VoxelRange& range, std::size_t first, std::span<VoxelRange> boxes) {
  HWY_DYNAMIC_DISPATCH(box_runs)(job, range, first, boxes);
}

}  // namespace kernels

namespace {

double voxels_of(const VoxelRange& box) {
  double out = 1;
  for (std::size_t a = 0; a < 3; ++a) out *= 1.0 + box.last[a] - box.first[a];
  return out;
}

}  // namespace

void Inverted::add(const VoxelRange& voxels) {
  // Into the box that grows least, unless there is room for another that would not be larger than the growth.
  std::size_t best = count;
  double least = count < most ? voxels_of(voxels) : std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < count; ++b) {
    const double growth = voxels_of(box[b].around(voxels)) - voxels_of(box[b]);
    if (growth > least) continue;
    least = growth;
    best = b;
  }
  if (best == count) {
    box[count++] = voxels;
  } else {
    box[best] = box[best].around(voxels);
  }
}

}  // namespace ecorche::runtime
#endif
