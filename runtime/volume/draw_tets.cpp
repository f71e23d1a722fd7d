// SPDX-License-Identifier: Apache-2.0
// A lane a tet: sixteen of them are set up at a time, then the voxels of the widest of their boxes are walked
// one after another, each tet's own at once, by adding to four whole numbers whose signs say what it holds.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/draw_tets.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "runtime/volume/draw_box-inl.hpp"
#include "runtime/volume/draw_tets.hpp"
#include "runtime/volume/tet_setup-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// How 64 bits are the voxels of a box: so many bits of a bit's number along each axis.
template <int kX, int kY, int kZ>
struct Layout {
  static_assert(kX + kY + kZ == 6);
  static constexpr std::array<int, 3> bits{kX, kY, kZ};
  static constexpr std::array<int, 3> first{0, kX, kX + kY};

  static constexpr int most(std::size_t axis) { return 1 << bits[axis]; }

  // The voxels of every box; at a bit of each of its sides less one.
  static constexpr std::array<std::uint64_t, 64> boxes() {
    std::array<std::uint64_t, 64> out{};
    for (unsigned size = 0; size < 64; ++size) {
      for (unsigned voxel = 0; voxel < 64; ++voxel) {
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) inside = inside && along(voxel, a) <= along(size, a);
        out[size] |= std::uint64_t{inside} << voxel;
      }
    }
    return out;
  }
  static constexpr int along(unsigned voxel, std::size_t axis) {
    return static_cast<int>(voxel >> static_cast<unsigned>(first[axis])) & (most(axis) - 1);
  }
};
using Cubes = Layout<2, 2, 2>;
using Slices = Layout<3, 3, 0>;  // of grids of one slice

template <class L>
constexpr std::array<std::uint64_t, 64> kBoxes = L::boxes();

using U32 = hn::RebindToUnsigned<I>;
using VU = hn::Vec<U32>;

// Sets the bits of what tets do not hold of boxes of nx x ny x nz voxels.
template <class L>
HWY_INLINE void walk(const Steps& steps, int nx, int ny, int nz, VU (&outside)[2]) {
  const VU sign = hn::Set(U32(), 0x80000000U);
  VI slice[4], row[4], at[4];
  for (int p = 0; p < 4; ++p) slice[p] = steps.at[p];
  outside[0] = outside[1] = hn::Zero(U32());
  for (int z = 0; z < nz; ++z) {
    for (int p = 0; p < 4; ++p) row[p] = slice[p];
    for (int y = 0; y < ny; ++y) {
      VU line = hn::Zero(U32());  // enters from above
      for (int p = 0; p < 4; ++p) at[p] = row[p];
      for (int x = 0; x < nx; ++x) {
        const VI any = hn::Or(hn::Or3(at[0], at[1], at[2]), at[3]);
        line = hn::OrAnd(hn::ShiftRight<1>(line), hn::BitCast(U32(), any), sign);
        for (int p = 0; p < 4; ++p) at[p] = hn::Add(at[p], steps.by[0][p]);
      }
      const int first = (y << L::first[1]) + (z << L::first[2]);
      VU& word = outside[first / 32];
      word = hn::Or(word, hn::ShiftRightSame(line, 32 - nx - first % 32));
      for (int p = 0; p < 4; ++p) row[p] = hn::Add(row[p], steps.by[1][p]);
    }
    for (int p = 0; p < 4; ++p) slice[p] = hn::Add(slice[p], steps.by[2][p]);
  }
}

// Voxels of a vector of tets in the order in which they are put: the tet's lane and the voxel's bit.
struct Hits {
  static constexpr std::size_t group = 4;  // written at once, whether or not there are so many
  std::size_t count = 0;
  HWY_ALIGN std::array<std::uint8_t, 64 * kMostLanes + group + kMostLanes> lane{}, voxel{};

  HWY_INLINE void add(std::size_t of_lane, std::uint64_t voxels) {
    constexpr std::uint64_t never_none = std::uint64_t{1} << 63U;  // or counting zeros would branch
    const std::uint32_t lanes = 0x01010101U * static_cast<std::uint32_t>(of_lane);
    static_assert(sizeof lanes == group);
    std::size_t at = count;
    count += static_cast<std::size_t>(std::popcount(voxels));
    do {
      std::memcpy(&lane[at], &lanes, group);
      for (std::size_t i = 0; i < group; ++i) {
        voxel[at + i] = static_cast<std::uint8_t>(std::countr_zero(voxels | never_none));
        voxels &= voxels - 1;
      }
      at += group;
    } while (HWY_UNLIKELY(voxels != 0));
  }
};

// Those of the bricks that are drawn.
template <class L>
void keep_bricks(const DrawTets& job, const Setup& tets, Hits& hits) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < hits.count; ++i) {
    const std::size_t t = hits.lane[i];
    const auto at = [&](std::size_t a) { return tets.first[a][t] + L::along(hits.voxel[i], a); };
    hits.lane[kept] = hits.lane[i];
    hits.voxel[kept] = hits.voxel[i];
    kept += job.only.has(at(0), at(1), at(2)) ? 1 : 0;
  }
  hits.count = kept;
}

// Puts all hits and forgets them.
template <class L>
HWY_INLINE void put_hits(const DrawTets& job, const Setup& tets, Hits& hits, VoxelBatch& batch,
                         const BatchSink& sink) {
  if (job.only) keep_bricks<L>(job, tets, hits);
  const std::size_t lanes = hn::Lanes(F());
  const VI row = hn::Set(I(), job.size[0]), slice = hn::Set(I(), job.size[0] * job.size[1]);
  for (std::size_t i = 0; i < hits.count; i += lanes) {
    const VI lane = hn::PromoteTo(I(), hn::LoadU(U8(), &hits.lane[i]));
    const VI voxel = hn::PromoteTo(I(), hn::LoadU(U8(), &hits.voxel[i]));
    const auto in_floats = hn::IndicesFromVec(F(), lane);
    const auto in_wholes = hn::IndicesFromVec(I(), lane);
    const auto fixed = [&](const std::int32_t* of)
                           HWY_ATTR { return hn::TableLookupLanes(hn::Load(I(), of), in_wholes); };
    const auto single = [&](const float* of)
                            HWY_ATTR { return hn::TableLookupLanes(hn::Load(F(), of), in_floats); };
    const auto along = [&](auto axis) HWY_ATTR {
      constexpr std::size_t a = decltype(axis)::value;
      return hn::And(hn::ShiftRight<L::first[a]>(voxel), hn::Set(I(), L::most(a) - 1));
    };
    const VI x = along(std::integral_constant<std::size_t, 0>());
    const VI y = along(std::integral_constant<std::size_t, 1>());
    const VI z = along(std::integral_constant<std::size_t, 2>());
    if (batch.count > VoxelBatch::capacity - lanes) {
      sink.sample(sink.to, batch);
      batch.count = 0;
    }
    const VI offset = hn::Add(hn::Add(fixed(tets.offset), x), hn::Add(hn::Mul(y, row), hn::Mul(z, slice)));
    hn::StoreU(hn::BitCast(U32(), offset), U32(), &batch.offset[batch.count]);
    const V fx = hn::ConvertTo(F(), x), fy = hn::ConvertTo(F(), y), fz = hn::ConvertTo(F(), z);
    for (std::size_t a = 0; a < 3; ++a) {
      const V at_x0 =
          hn::MulAdd(single(tets.to[a][1]), fy, hn::MulAdd(single(tets.to[a][2]), fz, single(tets.part[a])));
      hn::StoreU(hn::MulAdd(single(tets.to[a][0]), fx, at_x0), F(), &batch.part[a][batch.count]);
      hn::StoreU(fixed(tets.base[a]), I(), &batch.base[a][batch.count]);
    }
    batch.count += std::min(lanes, hits.count - i);
  }
  hits.count = 0;
}

// What drawing needs beside the job; kept on the stack.
struct Desk {
  Setup setup;
  Planes planes;
  Hits hits;
  HWY_ALIGN std::uint32_t outside[2][kMostLanes];
  HWY_ALIGN std::int32_t box[kMostLanes];  // which of kBoxes
};

HWY_INLINE std::size_t highest(std::uint32_t bits) {
  return 31U - static_cast<std::size_t>(std::countl_zero(bits));
}

// The tets of `tets.live`, the last first; `id`: of the first lane.
template <class L>
HWY_INLINE void draw_live(const DrawTets& job, const VoxelRange& range, const PosedTets& tets, std::size_t id,
                          Desk& desk, VoxelBatch& batch, const BatchSink& sink) {
  auto wide = hn::Gt(tets.count[0], hn::Set(I(), L::most(0)));
  VI box = hn::Sub(tets.count[0], hn::Set(I(), 1));
  for (std::size_t a = 1; a < 3; ++a) {
    wide = hn::Or(wide, hn::Gt(tets.count[a], hn::Set(I(), L::most(a))));
    box = hn::Add(box, hn::ShiftLeftSame(hn::Sub(tets.count[a], hn::Set(I(), 1)), L::first[a]));
  }
  hn::Store(box, I(), desk.box);
  const std::uint32_t wide_bits = bits_of(wide) & tets.live;
  const std::uint32_t one_by_one = (wide_bits | tets.flat) & tets.live;
  if (one_by_one != tets.live) {
    const auto side = [&](std::size_t a) HWY_ATTR {
      const VI held = hn::Min(tets.count[a], hn::Set(I(), L::most(a)));
      return hn::GetLane(hn::MaxOfLanes(I(), held));
    };
    VU outside[2];
    walk<L>(steps_of<L::most(0)>(tets), side(0), side(1), side(2), outside);
    for (std::size_t w = 0; w < 2; ++w) hn::Store(outside[w], U32(), desk.outside[w]);
  }
  if (wide_bits != 0) set_planes(tets, desk.planes);
  for (std::uint32_t left = tets.live; left != 0;) {
    const std::size_t t = highest(left);
    left ^= 1U << t;
    if (HWY_LIKELY((one_by_one >> t & 1U) == 0)) {
      const std::uint64_t out = desk.outside[0][t] | std::uint64_t{desk.outside[1][t]} << 32U;
      desk.hits.add(t, kBoxes<L>[static_cast<std::size_t>(desk.box[t])] & ~out);
      continue;
    }
    put_hits<L>(job, desk.setup, desk.hits, batch, sink);
    if ((tets.flat >> t & 1U) != 0) {
      draw_flat_tet(job, range, static_cast<std::uint32_t>(id + t), batch, sink);
    } else {
      draw_box(job, desk.setup, desk.planes, t, batch, sink);
    }
  }
  put_hits<L>(job, desk.setup, desk.hits, batch, sink);
}

// Which of the live tets lie the wrong way round; of those too flat for float32 by double precision.
HWY_INLINE std::uint32_t inverted_of(const DrawTets& job, const PosedTets& tets, std::size_t id) {
  std::uint32_t out = job.left_handed ? ~tets.turned : tets.turned;
  for (std::uint32_t flat = tets.flat & tets.live; flat != 0;) {
    const std::size_t t = highest(flat);
    flat ^= 1U << t;
    const bool positive = posed_det(job, static_cast<std::uint32_t>(id + t)) > 0;
    out = (out & ~(1U << t)) | (positive ? 0U : 1U << t);
  }
  return out & tets.live;
}

template <class L>
HWY_INLINE void draw_runs_as(const DrawTets& job, const VoxelRange& range,
                             std::span<const std::uint32_t> runs, Claim claim, VoxelBatch& batch,
                             const BatchSink& sink, Inverted& found) {
  constexpr std::size_t width = TetPalettes::width, ahead = 2, lines_ahead = 6;
  const std::size_t lanes = hn::Lanes(F()), all = static_cast<std::size_t>(job.tets.rows());
  const TetPalettes& palettes = job.palettes;
  Desk desk;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i + lines_ahead < runs.size()) {
      const std::uint8_t* line = palettes.corners(runs[i + lines_ahead]);
      for (std::size_t l = 0; l < 3; ++l) hwy::Prefetch(line + 64 * l);
    }
    if (i + ahead < runs.size()) {
      const std::size_t next = runs[i + ahead];
      ask_for(job.posed.data(), palettes.rows(next), palettes.filled(next), 2);
      ask_for(job.rest.data(), palettes.rows(next), palettes.filled(next), 2);
    }
    const std::size_t run = runs[i];
    const Run posed(palettes, run, job.posed.data()), rest(palettes, run, job.rest.data());
    for (std::size_t first = width; first > 0;) {
      first -= lanes;
      const std::size_t id = width * run + first;
      if (id >= all) continue;
      const Corners corners = posed.corners(first);
      PosedTets tets = posed_tets(job, range, corners);
      if (all - id < lanes) tets.live &= (1U << (all - id)) - 1U;
      if (tets.live == 0) continue;
      store_boxes(job, tets, desk.setup);
      const std::uint32_t inverted = inverted_of(job, tets, id);
      if (claim == Claim::inverted) {
        tets.live = inverted;
      } else {
        tets.live &= ~inverted;
        for (std::size_t t = 0; inverted != 0 && t < lanes; ++t) {
          if ((inverted >> t & 1U) == 0) continue;
          VoxelRange box;
          for (std::size_t a = 0; a < 3; ++a) {
            box.first[a] = desk.setup.first[a][t];
            box.last[a] = box.first[a] + desk.setup.count[a][t] - 1;
          }
          found.add(box);
        }
      }
      if (tets.live == 0) continue;
      store_maps(job, tets, corners, rest.corners(first), desk.setup);
      draw_live<L>(job, range, tets, id, desk, batch, sink);
    }
  }
}

void draw_runs(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> runs, Claim claim,
               VoxelBatch& batch, const BatchSink& sink, Inverted& found) {
  if (job.size[2] == 1) {
    draw_runs_as<Slices>(job, range, runs, claim, batch, sink, found);
  } else {
    draw_runs_as<Cubes>(job, range, runs, claim, batch, sink, found);
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(draw_runs);

void draw_runs(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> runs, Claim claim,
               VoxelBatch& batch, const BatchSink& sink, Inverted& found) {
  HWY_DYNAMIC_DISPATCH(draw_runs)(job, range, runs, claim, batch, sink, found);
}

}  // namespace ecorche::runtime::kernels
#endif
