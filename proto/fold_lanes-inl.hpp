// SPDX-License-Identifier: Apache-2.0
// The lanes of several vectors brought together; compiled once per instruction set.
#if defined(ECORCHE_PROTO_FOLD_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_PROTO_FOLD_LANES_INL
#undef ECORCHE_PROTO_FOLD_LANES_INL
#else
#define ECORCHE_PROTO_FOLD_LANES_INL
#endif

#include <hwy/highway.h>

#include "proto/triples-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::wire::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using V = hn::Vec<I16>;

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void extremes(const V* low, const V* high, std::int16_t* least, std::int16_t* largest) {
  for (std::size_t c = 0; c < 3; ++c) {
    least[c] = hn::GetLane(low[c]);
    largest[c] = hn::GetLane(high[c]);
  }
}

template <class F>
HWY_INLINE void sum_up(F, const hn::Vec<F>* v, float* sums) {
  for (std::size_t s = 0; s < 4; ++s) sums[s] = hn::GetLane(v[s]);
}
#else
// Halves of a vector combined until 128 bits are left.
template <class D, class Both>
HWY_INLINE auto folded(D, hn::Vec<D> v, Both both) {
  if constexpr (hn::MaxLanes(D()) * sizeof(hn::TFromD<D>) > 16) {
    const hn::Half<D> half;
    return folded(half, both(hn::LowerHalf(half, v), hn::UpperHalf(half, v)), both);
  } else {
    return v;
  }
}

// Neighbours of `Lane`s side by side, combined: a and b then alternate in the result, half of each left.
template <class Lane, class D, class Both>
HWY_INLINE hn::Vec<D> zipped(D d, hn::Vec<D> a, hn::Vec<D> b, Both both) {
  const hn::Repartition<Lane, D> wide;
  const auto wa = hn::BitCast(wide, a), wb = hn::BitCast(wide, b);
  return both(hn::BitCast(d, hn::InterleaveLower(wide, wa, wb)),
              hn::BitCast(d, hn::InterleaveUpper(wide, wa, wb)));
}

// Of three axes: one by one, lane by lane, that would cost as much as a quarter of a block's map.
HWY_INLINE void extremes(const V* low, const V* high, std::int16_t* least, std::int16_t* largest) {
  using Few = hn::CappedTag<std::int16_t, 8>;
  const Few few;
  const auto min = [](auto a, auto b) HWY_ATTR { return hn::Min(a, b); };
  hn::Vec<Few> v[6];
  for (std::size_t c = 0; c < 3; ++c) {
    v[c] = folded(I16(), low[c], min);
    v[3 + c] = folded(I16(), hn::Not(high[c]), min);  // the larger, the less its complement
  }
  const auto first = zipped<std::int16_t>(few, v[0], v[1], min),
             then = zipped<std::int16_t>(few, v[2], v[3], min),
             last = zipped<std::int16_t>(few, v[4], v[5], min);
  const auto all = zipped<std::int64_t>(few, zipped<std::int32_t>(few, first, then, min),
                                        zipped<std::int32_t>(few, last, last, min), min);
  HWY_ALIGN std::int16_t six[8];
  hn::Store(all, few, six);
  for (std::size_t c = 0; c < 3; ++c) {
    least[c] = six[c];
    largest[c] = static_cast<std::int16_t>(~six[3 + c]);
  }
}

// Of four vectors.
template <class F>
HWY_INLINE void sum_up(F f, const hn::Vec<F>* v, float* sums) {
  const auto add = [](auto a, auto b) HWY_ATTR { return hn::Add(a, b); };
  const auto four =
      zipped<double>(f, zipped<float>(f, v[0], v[1], add), zipped<float>(f, v[2], v[3], add), add);
  hn::StoreU(folded(f, four, add), hn::CappedTag<float, 4>(), sums);
}
#endif

}  // namespace ecorche::wire::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
