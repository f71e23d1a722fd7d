// SPDX-License-Identifier: Apache-2.0
// A vector of posed tets, a lane each: their planes as whole numbers, and their affine maps to the rest
// volume. Included once per instruction set.
#if defined(ECORCHE_RUNTIME_VOLUME_TET_SETUP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_VOLUME_TET_SETUP_INL
#undef ECORCHE_RUNTIME_VOLUME_TET_SETUP_INL
#else
#define ECORCHE_RUNTIME_VOLUME_TET_SETUP_INL
#endif

#include <cstring>

#include "runtime/skin/vectors-inl.hpp"
#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/draw_tets.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Of a plane's value, side x side x distance, over `reach`. Rounding to float32 moves it by less than 1e-6 of
// that, rounding steps to whole numbers by less than 27 of 2^25 (of 2^24 in slices).
constexpr float kMargin = 2e-6F;

HWY_INLINE V dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

template <class Mask>
HWY_INLINE std::uint32_t bits_of(Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(I(), mask, bytes);
  std::uint32_t out;
  std::memcpy(&out, bytes, sizeof out);
  return out;
}

// Posed tets whose box is counted from its first voxel of a range.
struct PosedTets {
  VI first[3], count[3];  // voxels; no count above zero: none
  V3 origin;              // corner 0, from the first voxel
  V3 n[3];                // inward: barycentric coordinate c is n_c . (x - corner 0) / size
  V size;                 // six times the volume
  V reach;                // longest side of the box squared, times that side or a voxel if that is more
  std::uint32_t live, flat, turned;  // a bit a lane: some voxels; too flat for float32; det < 0
};

HWY_INLINE V3 edge(const Corners& c, int to, V one) {
  const auto along = [&](int a) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(F(), hn::Sub(c.x[to][a], c.x[0][a])), one);
  };
  return {along(0), along(1), along(2)};
}

HWY_INLINE PosedTets posed_tets(const DrawTets& job, const VoxelRange& range, const Corners& corners) {
  PosedTets out;
  const V one = hn::Set(F(), 1.0F / static_cast<float>(1 << job.bits));
  V* const origin_of[3] = {&out.origin.x, &out.origin.y, &out.origin.z};
  VI least_count = hn::Set(I(), 1), longest = hn::Zero(I());
  for (int a = 0; a < 3; ++a) {
    const auto& c = corners.x;
    const VI low = hn::Min(hn::Min(c[0][a], c[1][a]), hn::Min(c[2][a], c[3][a]));
    const VI high = hn::Max(hn::Max(c[0][a], c[1][a]), hn::Max(c[2][a], c[3][a]));
    const auto along = static_cast<std::size_t>(a);
    const VI up = hn::Add(low, hn::Set(I(), (1 << job.bits) - 1));
    out.first[a] = hn::Max(hn::ShiftRightSame(up, job.bits), hn::Set(I(), range.first[along]));
    const VI last = hn::Min(hn::ShiftRightSame(high, job.bits), hn::Set(I(), range.last[along]));
    out.count[a] = hn::Add(hn::Sub(last, out.first[a]), hn::Set(I(), 1));
    least_count = hn::Min(least_count, out.count[a]);
    longest = hn::Max(longest, hn::Sub(high, low));
    const VI from = hn::Sub(c[0][a], hn::ShiftLeftSame(out.first[a], job.bits));
    *origin_of[a] = hn::Mul(hn::ConvertTo(F(), from), one);
  }
  out.live = bits_of(hn::Gt(least_count, hn::Zero(I())));
  const V3 e1 = edge(corners, 1, one), e2 = edge(corners, 2, one), e3 = edge(corners, 3, one);
  out.n[0] = cross(e2, e3);
  out.n[1] = cross(e3, e1);
  out.n[2] = cross(e1, e2);
  const V det = dot(e1, out.n[0]), side = hn::Mul(hn::ConvertTo(F(), longest), one);
  out.size = hn::Abs(det);
  const V squared = hn::Mul(side, side);
  out.reach = hn::Mul(squared, hn::Max(side, hn::Set(F(), 1.0F)));
  const V least = hn::Mul(hn::Set(F(), kFlatTet), hn::Mul(squared, side));
  out.flat = ~bits_of(hn::RebindMask(I(), hn::Gt(out.size, least)));
  const auto negative = hn::Lt(det, hn::Zero(F()));
  out.turned = bits_of(hn::RebindMask(I(), negative));
  const V sign = hn::CopySign(hn::Set(F(), 1.0F), det);
  for (V3& n : out.n) n = times(n, sign);
  return out;
}

// The four planes as whole numbers, above or at zero within: at the box's first voxel, and what a step along
// an axis adds.
struct Steps {
  VI at[4], by[3][4];
};

// Values are scaled so that none leaves 32 bits on the first `walked` voxels along each axis: with |n| at
// most 3 sides squared and as many voxels or a side away they are at most 5.2 walked times `reach`.
template <int walked>
HWY_INLINE Steps steps_of(const PosedTets& tets) {
  static_assert(walked == 4 || walked == 8);
  constexpr std::uint32_t bits = walked == 4 ? 25 : 24;
  const hn::RebindToUnsigned<I> u;
  const V reach = hn::Max(tets.reach, hn::Set(F(), 1e-30F));
  const auto exponent = hn::And(hn::BitCast(u, reach), hn::Set(u, 0x7f800000U));
  const V scale = hn::BitCast(F(), hn::Sub(hn::Set(u, (127U + bits + 127U) << 23U), exponent));
  const V margin = hn::Mul(hn::Mul(hn::Set(F(), kMargin), reach), scale);
  const VI out_by = to_nearest(margin);
  Steps out;
  VI sum[4] = {hn::Zero(I()), hn::Zero(I()), hn::Zero(I()), hn::Zero(I())};
  for (int p = 1; p < 4; ++p) {
    const V3 n = times(tets.n[p - 1], scale);
    const VI at = hn::Sub(hn::Zero(I()), to_nearest(dot(n, tets.origin)));
    out.at[p] = hn::Add(at, out_by);
    out.by[0][p] = to_nearest(n.x);
    out.by[1][p] = to_nearest(n.y);
    out.by[2][p] = to_nearest(n.z);
    sum[0] = hn::Add(sum[0], out.by[0][p]);
    sum[1] = hn::Add(sum[1], out.by[1][p]);
    sum[2] = hn::Add(sum[2], out.by[2][p]);
    sum[3] = hn::Add(sum[3], at);
  }
  // All four coordinates add up to the whole.
  out.at[0] = hn::Sub(hn::Add(to_nearest(hn::Mul(tets.size, scale)), out_by), sum[3]);
  for (int a = 0; a < 3; ++a) out.by[a][0] = hn::Sub(hn::Zero(I()), sum[a]);
  return out;
}

// What is kept of a vector of tets while its voxels are put, planar, a lane a tet.
struct Setup {
  HWY_ALIGN std::int32_t first[3][kMostLanes], count[3][kMostLanes];
  HWY_ALIGN std::int32_t offset[kMostLanes];  // of the box's first voxel in the posed grid
  // place = base + part + to * (x, y, z)
  HWY_ALIGN std::int32_t base[3][kMostLanes];
  HWY_ALIGN float part[3][kMostLanes], to[3][3][kMostLanes];
};

HWY_INLINE void store_boxes(const DrawTets& job, const PosedTets& tets, Setup& out) {
  for (int a = 0; a < 3; ++a) {
    hn::Store(tets.first[a], I(), out.first[a]);
    hn::Store(tets.count[a], I(), out.count[a]);
  }
  const VI rows = hn::Add(tets.first[1], hn::Mul(tets.first[2], hn::Set(I(), job.size[1])));
  hn::Store(hn::Add(hn::Mul(rows, hn::Set(I(), job.size[0])), tets.first[0]), I(), out.offset);
}

HWY_INLINE void store_maps(const DrawTets& job, const PosedTets& tets, const Corners& posed,
                           const Corners& rest, Setup& out) {
  const V one = hn::Set(F(), 1.0F / static_cast<float>(1 << job.bits));
  const V inverse = hn::Div(one, tets.size);
  const VI mask = hn::Set(I(), (1 << job.bits) - 1);
  const V3 n[3] = {times(tets.n[0], inverse), times(tets.n[1], inverse), times(tets.n[2], inverse)};
  for (int a = 0; a < 3; ++a) {
    // The shift of corner 0 in whole voxels and a part, both exact.
    const VI shift = job.same_lattice ? hn::Sub(rest.x[0][a], posed.x[0][a]) : rest.x[0][a];
    const VI voxels = hn::ShiftRightSame(shift, job.bits);
    hn::Store(job.same_lattice ? hn::Add(voxels, tets.first[a]) : voxels, I(), out.base[a]);
    V3 row{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
    for (int c = 1; c < 4; ++c) {
      VI moved = hn::Sub(rest.x[c][a], rest.x[0][a]);
      if (job.same_lattice) moved = hn::Sub(moved, hn::Sub(posed.x[c][a], posed.x[0][a]));
      row = plus_times(row, hn::ConvertTo(F(), moved), n[c - 1]);
    }
    const V part = hn::Mul(hn::ConvertTo(F(), hn::And(shift, mask)), one);
    hn::Store(hn::Sub(part, dot(row, tets.origin)), F(), out.part[a]);
    // On one lattice the shift moves along with the voxel.
    const V own = hn::Set(F(), job.same_lattice ? 1.0F : 0.0F);
    hn::Store(a == 0 ? hn::Add(row.x, own) : row.x, F(), out.to[a][0]);
    hn::Store(a == 1 ? hn::Add(row.y, own) : row.y, F(), out.to[a][1]);
    hn::Store(a == 2 ? hn::Add(row.z, own) : row.z, F(), out.to[a][2]);
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
