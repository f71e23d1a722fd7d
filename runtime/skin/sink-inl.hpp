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
#include <type_traits>

#include "runtime/skin/move_vertices.hpp"
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

/// The places of a vector's vertices: `count` of them from `first` on, or those that `scattered` names.
struct Places {
  std::size_t first, count;
  const std::uint32_t* scattered;

  /// `write` puts a whole vector's rows of three to where it is told.
  template <class T, class Write>
  HWY_INLINE void store(T* out, Write write) const {
    const bool in_one = scattered == nullptr && count == hn::Lanes(F());
    HWY_ALIGN T rows[3 * 16];
    write(in_one ? out + 3 * first : rows);  // once, or compilers will not have it inline
    if (HWY_LIKELY(in_one)) return;
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(out + 3 * (scattered == nullptr ? first + i : scattered[i]), rows + 3 * i, 3 * sizeof(T));
    }
  }
};

/// x to the nearest whole number, halves to even. |x| below 2^31.
HWY_INLINE hn::Vec<I> nearest(V x) {
#if HWY_TARGET <= HWY_AVX3
  return hn::Vec<I>{_mm512_cvtps_epi32(x.raw)};  // Highway's looks for what is beyond
#else
  return hn::NearestInt(x);
#endif
}

#if HWY_TARGET <= HWY_AVX3
// Where a row's numbers lie after x and y, and z twice, were packed: in fours of x and y, and of z.
struct RowOrder {
  alignas(64) std::uint16_t at[64];

  constexpr RowOrder() : at() {
    for (unsigned p = 0; p < 48; ++p) {
      const unsigned i = p / 3, c = p % 3;
      at[p] = static_cast<std::uint16_t>(8 * (i / 4) + i % 4 + (c == 0 ? 0 : c == 1 ? 4 : 32));
    }
  }
};
inline constexpr RowOrder kRowOrder;
#endif

/// Three columns of whole numbers as rows of 16 bits each, what is beyond them as the nearest; T says which.
template <class T>
HWY_INLINE void store_rows(hn::Vec<I> x, hn::Vec<I> y, hn::Vec<I> z, T* out) {
#if HWY_TARGET <= HWY_AVX3
  const auto pack = [](__m512i a, __m512i b) HWY_ATTR {
    return std::is_signed_v<T> ? _mm512_packs_epi32(a, b) : _mm512_packus_epi32(a, b);
  };
  const __m512i xy = pack(x.raw, y.raw), zz = pack(z.raw, z.raw);
  const auto rows = [&](std::size_t from) HWY_ATTR {
    return _mm512_permutex2var_epi16(xy, _mm512_load_si512(kRowOrder.at + from), zz);
  };
  _mm512_storeu_si512(out, rows(0));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + 32), _mm512_castsi512_si256(rows(32)));
#else
  const hn::Rebind<T, F> d;
  hn::StoreInterleaved3(hn::DemoteTo(d, x), hn::DemoteTo(d, y), hn::DemoteTo(d, z), d, out);
#endif
}

/// A VertexSink of the kernels' own, which no store can be thought to change.
class Sink {
 public:
  explicit Sink(const VertexSink& out) : out_(out), per_step_(out.box.step > 0 ? 1 / out.box.step : 0) {}

  /// Asks for where `count` vertices in a row go: what is written here and there is not foreseen.
  HWY_INLINE void ask_for(std::size_t first, std::size_t count) const {
    if (out_.positions != nullptr) ask(out_.positions, first, count);
    if (out_.quantised != nullptr) ask(out_.quantised, first, count);
    if (out_.normals != nullptr) ask(out_.normals, first, count);
  }

  HWY_INLINE void put_position(const Places& places, const V3& p) const {
    if (out_.positions != nullptr) {
      places.store(out_.positions,
                   [&](float* to) HWY_ATTR { hn::StoreInterleaved3(p.x, p.y, p.z, F(), to); });
    }
    if (out_.quantised != nullptr) {
      places.store(out_.quantised, [&](std::uint16_t* to) HWY_ATTR {
        store_rows(number(p.x, 0), number(p.y, 1), number(p.z, 2), to);
      });
    }
  }

  /// n needs no length; zero where it is zero or `real` is not set.
  HWY_INLINE void put_normal(const Places& places, const V3& n, hn::Mask<F> real) const {
    const V squared = hn::MulAdd(n.x, n.x, hn::MulAdd(n.y, n.y, hn::Mul(n.z, n.z)));
    const V3 unit = times(n, hn::IfThenElseZero(real, hn::Mul(inverse_root(squared), all(32767))));
    places.store(out_.normals, [&](std::int16_t* to) HWY_ATTR {
      store_rows(nearest(unit.x), nearest(unit.y), nearest(unit.z), to);
    });
  }

 private:
  template <class T>
  static HWY_INLINE void ask(const T* rows, std::size_t first, std::size_t count) {
    constexpr std::size_t line = 64 / sizeof(T);
    for (std::size_t i = 0; i < 3 * count; i += line) __builtin_prefetch(rows + 3 * first + i, 1);
  }

  // Storing keeps it at 0 and more.
  HWY_INLINE hn::Vec<I> number(V x, std::size_t c) const {
    const V steps = hn::Mul(hn::Sub(x, all(out_.box.low[c])), all(per_step_));
    return nearest(hn::Min(steps, all(65535)));
  }

  VertexSink out_;
  float per_step_;
};

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
