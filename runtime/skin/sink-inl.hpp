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
using U32 = hn::Rebind<std::uint32_t, F>;

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

HWY_INLINE hn::Vec<I16> narrow_unit(V x) {
  return hn::DemoteTo(I16(), hn::NearestInt(hn::Mul(x, all(32767))));
}

/// A VertexSink of the kernels' own, which no store can be thought to change.
class Sink {
 public:
  explicit Sink(const VertexSink& out)
      : out_(out), per_step_(out.box.step > 0 ? 1 / out.box.step : 0), widest_(65535 * out.box.step) {}

  bool wants_normals() const { return out_.normals != nullptr; }

  HWY_INLINE void put_position(const Places& places, const V3& p) const {
    if (out_.positions != nullptr) places.store(F(), p.x, p.y, p.z, out_.positions);
    if (out_.quantised != nullptr)
      places.store(U16(), quantise(p.x, 0), quantise(p.y, 1), quantise(p.z, 2), out_.quantised);
  }

  /// n needs no length; a zero stays zero.
  HWY_INLINE void put_normal(const Places& places, const V3& n) const {
    const V squared = hn::MulAdd(n.x, n.x, hn::MulAdd(n.y, n.y, hn::Mul(n.z, n.z)));
    const V3 unit = times(n, inverse_root(squared));
    places.store(I16(), narrow_unit(unit.x), narrow_unit(unit.y), narrow_unit(unit.z), out_.normals);
  }

 private:
  // Between 2^23 and 2^24 floats are whole numbers: what is added to the middle of that is rounded to
  // nearest, and its low 16 bits are the number.
  HWY_INLINE hn::Vec<U16> quantise(V x, std::size_t c) const {
    const V beyond = hn::Sub(x, all(out_.box.low[c]));
    const V within = hn::Min(hn::Max(beyond, hn::Zero(F())), all(widest_));
    const V number = hn::MulAdd(within, all(per_step_), all(12582912.0F));
    return hn::TruncateTo(U16(), hn::BitCast(U32(), number));
  }

  VertexSink out_;
  float per_step_, widest_;
};

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
