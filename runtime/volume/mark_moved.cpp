// SPDX-License-Identifier: Apache-2.0
// Bricks that tets left or came to.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/mark_moved.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <atomic>

#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/draw_tets.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

HWY_INLINE void mark(const Bricks& bricks, const std::int32_t (&first)[3], const std::int32_t (&last)[3],
                     std::uint8_t* moved) {
  for (std::size_t a = 0; a < 3; ++a) {
    if (first[a] > last[a]) return;
  }
  for (std::int32_t z = first[2] / Bricks::edge; z <= last[2] / Bricks::edge; ++z) {
    for (std::int32_t y = first[1] / Bricks::edge; y <= last[1] / Bricks::edge; ++y) {
      const std::size_t row = bricks.row_of(Bricks::edge * y, Bricks::edge * z);
      for (std::int32_t x = first[0] / Bricks::edge; x <= last[0] / Bricks::edge; ++x) {
        // Everybody writes the same 1, and reads first: most were marked by a neighbour.
        const std::atomic_ref<std::uint8_t> brick(moved[row + static_cast<std::size_t>(x)]);
        if (brick.load(std::memory_order_relaxed) == 0) brick.store(1, std::memory_order_relaxed);
      }
    }
  }
}

void mark_moved(const DrawTets& job, std::span<const std::int32_t> before, const VoxelRange& range,
                const Bricks& bricks, std::size_t begin, std::size_t end, std::uint8_t* moved) {
  const std::size_t lanes = hn::Lanes(F());
  const auto mark_vector = [&](const Corners(&corners)[2], std::size_t count) HWY_ATTR {
    VI differ = hn::Zero(I());
    for (int c = 0; c < 4; ++c) {
      for (int a = 0; a < 3; ++a) differ = hn::Or(differ, hn::Xor(corners[0].x[c][a], corners[1].x[c][a]));
    }
    if (hn::AllTrue(I(), hn::Eq(differ, hn::Zero(I())))) return;
    HWY_ALIGN std::int32_t different[kMostLanes];
    hn::Store(differ, I(), different);
    for (const Corners& at : corners) {
      HWY_ALIGN std::int32_t first[3][kMostLanes], last[3][kMostLanes];
      for (std::size_t a = 0; a < 3; ++a) {
        const Span span = span_of(at, static_cast<int>(a), job.bits, range.first[a], range.last[a]);
        hn::Store(span.first, I(), first[a]);
        hn::Store(span.last, I(), last[a]);
      }
      for (std::size_t i = 0; i < count; ++i) {
        if (different[i] == 0) continue;
        mark(bricks, {first[0][i], first[1][i], first[2][i]}, {last[0][i], last[1][i], last[2][i]}, moved);
      }
    }
  };
  for (std::size_t t = begin; t < end; t += TetPalettes::width) {
    const std::size_t run = t / TetPalettes::width;
    const Run was(job.palettes, run, before.data()), is(job.palettes, run, job.posed.data());
    for (std::size_t i = 0; i < std::min(TetPalettes::width, end - t); i += lanes)
      mark_vector({was.corners(i), is.corners(i)}, std::min(lanes, end - t - i));
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(mark_moved);

void mark_moved(const DrawTets& job, std::span<const std::int32_t> before, const VoxelRange& range,
                const Bricks& bricks, std::size_t begin, std::size_t end, std::uint8_t* moved) {
  HWY_DYNAMIC_DISPATCH(mark_moved)(job, before, range, bricks, begin, end, moved);
}

}  // namespace ecorche::runtime::kernels
#endif
