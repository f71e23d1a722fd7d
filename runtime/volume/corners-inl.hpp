// SPDX-License-Identifier: Apache-2.0
// Corners of a vector of tets as whole numbers, and the voxels that their boxes hold. Included once per
// instruction set.
#if defined(ECORCHE_RUNTIME_VOLUME_CORNERS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_VOLUME_CORNERS_INL
#undef ECORCHE_RUNTIME_VOLUME_CORNERS_INL
#else
#define ECORCHE_RUNTIME_VOLUME_CORNERS_INL
#endif

#include <hwy/highway.h>

#include "runtime/skin/palette-inl.hpp"
#include "runtime/volume/tet_palettes.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using VI = hn::Vec<I>;

constexpr std::size_t kMostLanes = 16;

// What surely fits 32 bits, to the nearest or down towards zero: saturating costs more than converting.
HWY_INLINE VI to_nearest(V x) {
#if HWY_TARGET <= HWY_AVX3
  return VI{_mm512_cvtps_epi32(x.raw)};
#else
  return hn::NearestInt(x);
#endif
}

HWY_INLINE VI truncated(V x) {
#if HWY_TARGET <= HWY_AVX3
  return VI{_mm512_cvttps_epi32(x.raw)};
#else
  return hn::ConvertTo(I(), x);
#endif
}

// The corners of a vector of tets, whole numbers.
struct Corners {
  VI x[4][3];
};

// One run of sixteen tets, its nodes fetched from one set of places.
#if HWY_TARGET > HWY_AVX3 && HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
class Run {
 public:
  HWY_INLINE Run(const TetPalettes& palettes, std::size_t run, const std::int32_t* places)
      : nodes_(places, palettes.rows(run), palettes.filled(run)), corners_(palettes.corners(run)) {}
  HWY_INLINE Corners corners(std::size_t i) const {
    Corners out;
    for (std::size_t c = 0; c < 4; ++c) {
      const std::uint8_t* at = corners_ + TetPalettes::width * c + i;
      const auto [x, y, z] = nodes_.columns([&](std::size_t lane) { return std::size_t{at[lane]}; });
      out.x[c][0] = x;
      out.x[c][1] = y;
      out.x[c][2] = z;
    }
    return out;
  }

 private:
  PaletteRows<std::int32_t, kMostPalette> nodes_;
  const std::uint8_t* corners_;
};
#else
// Those of tets i .. i + lanes of a run, whose palette lies in `table`.
template <bool kLong>
HWY_INLINE Corners corners_of(const Table<std::int32_t>& table, const std::uint8_t* corners) {
  Corners out;
  for (std::size_t c = 0; c < 4; ++c) {
    const Corner at(corners + TetPalettes::width * c);
    out.x[c][0] = at.template of<kLong>(table.x);
    out.x[c][1] = at.template of<kLong>(table.y);
    out.x[c][2] = at.template of<kLong>(table.z);
  }
  return out;
}

class Run {
 public:
  HWY_INLINE Run(const TetPalettes& palettes, std::size_t run, const std::int32_t* places)
      : corners_(palettes.corners(run)), long_(palettes.filled(run) > 32) {
    fetch(places, palettes.rows(run), palettes.filled(run), table_);
  }
  HWY_INLINE Corners corners(std::size_t i) const {
    return long_ ? corners_of<true>(table_, corners_ + i) : corners_of<false>(table_, corners_ + i);
  }

 private:
  Table<std::int32_t> table_;
  const std::uint8_t* corners_;
  bool long_;
};
#endif

// First and last voxel of the boxes along an axis, within [low, high].
struct Span {
  VI first, last;
};

HWY_INLINE Span span_of(const Corners& c, int axis, int bits, std::int32_t low, std::int32_t high) {
  const VI least = hn::Min(hn::Min(c.x[0][axis], c.x[1][axis]), hn::Min(c.x[2][axis], c.x[3][axis]));
  const VI most = hn::Max(hn::Max(c.x[0][axis], c.x[1][axis]), hn::Max(c.x[2][axis], c.x[3][axis]));
  const VI up = hn::Add(least, hn::Set(I(), (1 << bits) - 1));
  return {hn::Max(hn::ShiftRightSame(up, bits), hn::Set(I(), low)),
          hn::Min(hn::ShiftRightSame(most, bits), hn::Set(I(), high))};
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
