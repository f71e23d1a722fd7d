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

/// Rows of three numbers turned into columns, four or eight at a time; `rows`: where each begins in `places`,
/// filled up to a multiple of eight. The fourth number that is loaded of a row is its neighbour's.
template <class T>
HWY_INLINE void fetch(const T* places, const std::uint32_t* rows, std::size_t count, Table<T>& table) {
#if HWY_TARGET == HWY_SCALAR
  for (std::size_t i = 0; i < count; ++i) {
    const T* x = places + rows[i];
    table.x[i] = x[0];
    table.y[i] = x[1];
    table.z[i] = x[2];
  }
#else
#if HWY_TARGET <= HWY_AVX2
  const hn::FixedTag<T, 8> d;
  const hn::FixedTag<T, 4> half;
  const auto load = [&](std::size_t i) HWY_ATTR {
    return hn::Combine(d, hn::LoadU(half, places + rows[i + 4]), hn::LoadU(half, places + rows[i]));
  };
#else
  const hn::FixedTag<T, 4> d;
  const auto load = [&](std::size_t i) HWY_ATTR { return hn::LoadU(d, places + rows[i]); };
#endif
  const hn::RepartitionToWide<decltype(d)> pairs;
  const auto low = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveLower(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  const auto high = [&](auto a, auto b) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveUpper(pairs, hn::BitCast(pairs, a), hn::BitCast(pairs, b)));
  };
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto a = load(i), b = load(i + 1), e = load(i + 2), f = load(i + 3);
    const auto xy_ab = hn::InterleaveLower(d, a, b), xy_ef = hn::InterleaveLower(d, e, f);
    const auto z_ab = hn::InterleaveUpper(d, a, b), z_ef = hn::InterleaveUpper(d, e, f);
    hn::Store(low(xy_ab, xy_ef), d, table.x + i);
    hn::Store(high(xy_ab, xy_ef), d, table.y + i);
    hn::Store(low(z_ab, z_ef), d, table.z + i);
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
