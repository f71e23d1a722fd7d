// SPDX-License-Identifier: Apache-2.0
// Nodes that sixteen tets or vertices share: fetched once, and found again by a byte. Included once per
// instruction set.
#if defined(ECORCHE_RUNTIME_SKIN_PALETTE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_PALETTE_INL
#undef ECORCHE_RUNTIME_SKIN_PALETTE_INL
#else
#define ECORCHE_RUNTIME_SKIN_PALETTE_INL
#endif

#include <hwy/cache_control.h>

#include <cstddef>

#include "runtime/skin/lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr std::size_t kMostPalette = 64;

/// A palette, one coordinate after another; T: float or int32.
template <class T>
struct Table {
  HWY_ALIGN T x[kMostPalette], y[kMostPalette], z[kMostPalette];
};

#if HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
/// How many rows turned() takes.
template <class T>
using Turned = hn::FixedTag<T, HWY_TARGET <= HWY_AVX2 ? 8 : 4>;

template <class T>
struct Columns {
  hn::Vec<Turned<T>> x, y, z;
};

/// Rows of three numbers turned into columns. `row(i)`: four numbers that begin with those of row i.
template <class T, class Row>
HWY_INLINE Columns<T> turned(const Row& row) {
  const Turned<T> d;
  const hn::RepartitionToWide<decltype(d)> pairs;
#if HWY_TARGET <= HWY_AVX2
  const auto load = [&](std::size_t i) HWY_ATTR { return hn::Combine(d, row(i + 4), row(i)); };
#else
  const auto load = [&](std::size_t i) HWY_ATTR { return row(i); };
#endif
  const auto low = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto high = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto a = load(0), b = load(1), e = load(2), f = load(3);
  const auto xy_ab = hn::InterleaveLower(d, a, b), xy_ef = hn::InterleaveLower(d, e, f);
  const auto z_ab = hn::InterleaveUpper(d, a, b), z_ef = hn::InterleaveUpper(d, e, f);
  return {low(xy_ab, xy_ef), high(xy_ab, xy_ef), low(z_ab, z_ef)};
}
#endif

#if HWY_TARGET > HWY_AVX3 && HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE
/// A palette row by row, for processors whose registers hold no tables: whole rows are loaded and turned into
/// columns, which takes a third of the loads of gathers.
template <class T, std::size_t kMost>
class PaletteRows {
 public:
  HWY_INLINE PaletteRows(const T* places, const std::uint32_t* rows, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      hn::Store(hn::LoadU(Row(), places + rows[i]), Row(), rows_ + 4 * i);
  }

  /// As many as a vector has lanes; `at(i)`: the i-th's row of the palette.
  template <class At>
  HWY_INLINE Columns<T> columns(const At& at) const {
    static_assert(hn::MaxLanes(F()) == hn::MaxLanes(Turned<T>()));
    return turned<T>([&](std::size_t i) HWY_ATTR { return hn::Load(Row(), rows_ + 4 * at(i)); });
  }

 private:
  using Row = hn::FixedTag<T, 4>;
  HWY_ALIGN T rows_[4 * kMost];
};
#endif

/// Rows of three numbers turned into columns; `rows`: where each begins in `places`, filled up to a multiple
/// of eight. The fourth number that is loaded of a row is its neighbour's.
template <class T>
HWY_INLINE void fetch(const T* places, const std::uint32_t* rows, std::size_t count, Table<T>& table) {
#if HWY_TARGET == HWY_SCALAR || HWY_HAVE_SCALABLE
  for (std::size_t i = 0; i < count; ++i) {
    const T* x = places + rows[i];
    table.x[i] = x[0];
    table.y[i] = x[1];
    table.z[i] = x[2];
  }
#else
  const Turned<T> d;
  const hn::FixedTag<T, 4> four;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const Columns<T> columns =
        turned<T>([&](std::size_t k) HWY_ATTR { return hn::LoadU(four, places + rows[i + k]); });
    hn::Store(columns.x, d, table.x + i);
    hn::Store(columns.y, d, table.y + i);
    hn::Store(columns.z, d, table.z + i);
  }
#endif
}

/// Asks for what fetch() will want. Where rows are sorted and lie close every second one meets nearly every
/// line.
template <class T>
HWY_INLINE void ask_for(const T* places, const std::uint32_t* rows, std::size_t count, std::size_t step) {
  for (std::size_t i = 0; i < count; i += step) hwy::Prefetch(places + rows[i]);
}

/// The corners of a vector of tets, by their bytes in the palette. A gather costs sixteen loads: tables in
/// registers answer 32 entries at once, and the high bit chooses between two of them. kLong: the palette may
/// have more than 32.
struct Corner {
  hn::Vec<I> at;

#if HWY_TARGET <= HWY_AVX3
  hn::Mask<I> beyond;

  explicit HWY_INLINE Corner(const std::uint8_t* corners)
      : at(hn::PromoteTo(I(), hn::LoadU(U8(), corners))), beyond(hn::Gt(at, hn::Set(I(), 31))) {}

  template <bool kLong, class T>
  HWY_INLINE hn::Vec<hn::Rebind<T, F>> of(const T* column) const {
    const hn::Rebind<T, F> d;
    const auto bits = [&](std::size_t from)
                          HWY_ATTR { return hn::BitCast(I(), hn::Load(d, column + from)).raw; };
    const hn::Vec<I> low{_mm512_permutex2var_epi32(bits(0), at.raw, bits(16))};
    if constexpr (!kLong) return hn::BitCast(d, low);
    const hn::Vec<I> high{_mm512_permutex2var_epi32(bits(32), at.raw, bits(48))};
    return hn::BitCast(d, hn::IfThenElse(beyond, high, low));
  }
#else
  explicit HWY_INLINE Corner(const std::uint8_t* corners)
      : at(hn::PromoteTo(I(), hn::LoadU(U8(), corners))) {}

  template <bool kLong, class T>
  HWY_INLINE hn::Vec<hn::Rebind<T, F>> of(const T* column) const {
    return hn::GatherIndex(hn::Rebind<T, F>(), column, at);
  }
#endif
};

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
