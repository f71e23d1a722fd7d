// SPDX-License-Identifier: Apache-2.0
// Interleaved coordinates in vectors; compiled once per instruction set.
#if defined(ECORCHE_PROTO_TRIPLES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_PROTO_TRIPLES_INL
#undef ECORCHE_PROTO_TRIPLES_INL
#else
#define ECORCHE_PROTO_TRIPLES_INL
#endif

#include <hwy/highway.h>

#include "proto/delta.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::wire::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using I16 = hn::CappedTag<std::int16_t, delta::lanes>;
using U16 = hn::Rebind<std::uint16_t, I16>;

// Three coordinates of a vector's lanes from interleaved numbers.
struct Triples {
#if HWY_TARGET <= HWY_AVX3
  // Of 96 numbers in three registers, lane i of axis c is number 3 i + c: two looks through tables each.
  static constexpr int kTable = 32;
  hn::Vec<U16> first[3], then[3];

  HWY_INLINE Triples() {
    HWY_ALIGN std::uint16_t low[kTable], high[kTable];
    for (int c = 0; c < 3; ++c) {
      for (int i = 0; i < kTable; ++i) {
        const int at = 3 * i + c;
        low[i] = static_cast<std::uint16_t>(at % (2 * kTable));
        high[i] = static_cast<std::uint16_t>(at < 2 * kTable ? i : at - kTable);
      }
      first[c] = hn::Load(U16(), low);
      then[c] = hn::Load(U16(), high);
    }
  }
  HWY_INLINE hn::Vec<U16> axis(int c, __m512i a, __m512i b, __m512i more) const {
    return hn::Vec<U16>{
        _mm512_permutex2var_epi16(_mm512_permutex2var_epi16(a, first[c].raw, b), then[c].raw, more)};
  }
  HWY_INLINE void load(const std::uint16_t* from, hn::Vec<U16>& x, hn::Vec<U16>& y, hn::Vec<U16>& z) const {
    const auto a = hn::LoadU(U16(), from).raw, b = hn::LoadU(U16(), from + kTable).raw,
               c = hn::LoadU(U16(), from + 2 * kTable).raw;
    x = axis(0, a, b, c);
    y = axis(1, a, b, c);
    z = axis(2, a, b, c);
  }
#else
  HWY_INLINE void load(const std::uint16_t* from, hn::Vec<U16>& x, hn::Vec<U16>& y, hn::Vec<U16>& z) const {
    hn::LoadInterleaved3(U16(), from, x, y, z);
  }
#endif
};

}  // namespace ecorche::wire::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
