// SPDX-License-Identifier: Apache-2.0
// Vectors of vertices to where they belong, once per instruction set.
#if defined(ECORCHE_RUNTIME_SKIN_SINK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_SINK_INL
#undef ECORCHE_RUNTIME_SKIN_SINK_INL
#else
#define ECORCHE_RUNTIME_SKIN_SINK_INL
#endif

#include <algorithm>
#include <cstring>

#include "runtime/skin/move_vertices.hpp"
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

using I16 = hn::Rebind<std::int16_t, F>;

/// The places of a vector's vertices: `count` of them from `first` on, or those that `scattered` names.
struct Places {
  std::size_t first, count;
  const std::uint32_t* scattered;

  template <class D, class X>
  HWY_INLINE void store(D d, X x, X y, X z, hn::TFromD<D>* out) const {
    using T = hn::TFromD<D>;
    if (HWY_LIKELY(scattered == nullptr && count == hn::Lanes(d))) {
      return hn::StoreInterleaved3(x, y, z, d, out + 3 * first);
    }
    HWY_ALIGN T rows[3 * 16];
    hn::StoreInterleaved3(x, y, z, d, rows);
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(out + 3 * (scattered == nullptr ? first + i : scattered[i]), rows + 3 * i, 3 * sizeof(T));
    }
  }
};

HWY_INLINE hn::Vec<U16> quantise(V x, float low, float per_step) {
  const V number = hn::Mul(hn::Sub(x, all(low)), all(per_step));
  return hn::DemoteTo(U16(), hn::NearestInt(hn::Min(hn::Max(number, all(0)), all(65535))));
}

HWY_INLINE hn::Vec<I16> narrow_unit(V x) {
  return hn::DemoteTo(I16(), hn::NearestInt(hn::Mul(x, all(32767))));
}

HWY_INLINE void put_position(const VertexSink& out, const Places& places, const V3& p) {
  if (out.positions != nullptr) places.store(F(), p.x, p.y, p.z, out.positions);
  if (out.quantised != nullptr) {
    const float per_step = 1 / out.box.step;
    places.store(U16(), quantise(p.x, out.box.low[0], per_step), quantise(p.y, out.box.low[1], per_step),
                 quantise(p.z, out.box.low[2], per_step), out.quantised);
  }
}

/// 1 / sqrt(x) to 2e-5 of itself, half a step of i16; x within [1e-30, 1e30]. One step of Newton's costs less
/// than a root and a division.
HWY_INLINE V inverse_root(V x) {
  const V guess = hn::ApproximateReciprocalSqrt(x);
  const V less = hn::NegMulAdd(hn::Mul(hn::Mul(x, guess), all(0.5F)), guess, all(0.5F));
  return hn::MulAdd(guess, less, guess);
}

/// n needs no length; a zero stays zero.
HWY_INLINE void put_normal(const VertexSink& out, const Places& places, const V3& n) {
  const V squared = hn::MulAdd(n.x, n.x, hn::MulAdd(n.y, n.y, hn::Mul(n.z, n.z)));
  const V3 unit = times(n, inverse_root(hn::Min(hn::Max(squared, all(1e-30F)), all(1e30F))));
  places.store(I16(), narrow_unit(unit.x), narrow_unit(unit.y), narrow_unit(unit.z), out.normals);
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
