// SPDX-License-Identifier: Apache-2.0
// Whether a tet holds a point: a run's sixteen at once by their steps, which may say yes too often, then one
// alone. Included once per instruction set.
#if defined(ECORCHE_RUNTIME_PROBE_TET_HOLDS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_PROBE_TET_HOLDS_INL
#undef ECORCHE_RUNTIME_PROBE_TET_HOLDS_INL
#else
#define ECORCHE_RUNTIME_PROBE_TET_HOLDS_INL
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <ecorche/runtime/tet_runs.hpp>
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

constexpr double kMargin = 1e-10;
constexpr double kFlat = 1e-12;
// By how many steps a node may lie beside its own of a PackedRun: half of one, and what float32 rounds off.
constexpr float kStep = 0.51F;

HWY_INLINE std::uint32_t bits_of(hn::Mask<F> mask) {
  HWY_ALIGN std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(F(), mask, bytes);
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8U;
}

struct Vec {
  double x, y, z;
};
HWY_INLINE Vec minus(const float* a, const float* b) {
  return {static_cast<double>(a[0]) - static_cast<double>(b[0]),
          static_cast<double>(a[1]) - static_cast<double>(b[1]),
          static_cast<double>(a[2]) - static_cast<double>(b[2])};
}
HWY_INLINE Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
HWY_INLINE double dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
HWY_INLINE double distance2(const Vec& a, const Vec& b) {
  const Vec d{a.x - b.x, a.y - b.y, a.z - b.z};
  return dot(d, d);
}

// Six times the signed volume of the tet where it holds the point, else 0.
HWY_INLINE double held_by(const float* const (&corner)[4], const float* point, double* barycentric) {
  const Vec u = minus(corner[1], corner[0]), v = minus(corner[2], corner[0]), w = minus(corner[3], corner[0]);
  const Vec d = minus(point, corner[0]);
  const Vec vw = cross(v, w), wu = cross(w, u), uv = cross(u, v);
  const double det = dot(u, vw);
  const double edge2 =
      std::max({dot(u, u), dot(v, v), dot(w, w), distance2(u, v), distance2(v, w), distance2(w, u)});
  const double cube = edge2 * std::sqrt(edge2), size = std::abs(det), side = det < 0 ? -1 : 1;
  if (!(size > kFlat * cube)) return 0;
  const double b1 = side * dot(d, vw), b2 = side * dot(d, wu), b3 = side * dot(d, uv);
  const double b0 = size - b1 - b2 - b3;
  if (!(std::min(std::min(b0, b1), std::min(b2, b3)) >= -kMargin * cube)) return 0;
  barycentric[1] = b1 / size;
  barycentric[2] = b2 / size;
  barycentric[3] = b3 / size;
  barycentric[0] = 1 - barycentric[1] - barycentric[2] - barycentric[3];
  return det;
}

// Nodes of a run, x, y and z in a byte each of a word, and the corners of a vector of its tets.
class Words {
 public:
#if HWY_TARGET <= HWY_AVX3_DL
  HWY_INLINE explicit Words(const PackedRun& run) {
    HWY_ALIGN static constexpr std::array<std::uint8_t, 128> from = [] {
      std::array<std::uint8_t, 128> at{};
      for (std::size_t i = 0; i < 80; ++i) at[i] = static_cast<std::uint8_t>(i / 4 * 3 + i % 4);
      return at;
    }();
    const __m512i bytes = _mm512_load_si512(&run);
    first_ = _mm512_maskz_permutexvar_epi8(kThree, _mm512_load_si512(from.data()), bytes);
    last_ = _mm512_maskz_permutexvar_epi8(kThree, _mm512_load_si512(from.data() + 64), bytes);
  }
  HWY_INLINE hn::Vec<I> at(const std::uint8_t* corners) const {
    const hn::Vec<I> places = hn::PromoteTo(I(), hn::LoadU(U8(), corners));
    return hn::Vec<I>{_mm512_permutex2var_epi32(first_, places.raw, last_)};
  }

 private:
  static constexpr std::uint64_t kThree = 0x7777777777777777;
  __m512i first_, last_;
#else
  HWY_INLINE explicit Words(const PackedRun& run) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&run);
    for (std::size_t n = 0; n < PackedRun::most; ++n)
      std::memcpy(words_ + n, bytes + 3 * n, 4);  // one too many
  }
  HWY_INLINE hn::Vec<I> at(const std::uint8_t* corners) const {
    return hn::GatherIndex(I(), words_, hn::PromoteTo(I(), hn::LoadU(U8(), corners)));
  }

 private:
  std::int32_t words_[PackedRun::most];
#endif
};

// The tets of a vector that may hold the point, by their corners' steps. What a tet holds lies at most kStep,
// along each axis, from a point of the tet of its steps, so no face has it further on its outer side than
// that; nor, by the margin of held_by (1e-10 of edges of at most 442 steps, cubed), than another 1. Steps are
// whole numbers: normals are exact. What is no number is in all of them.
HWY_INLINE std::uint32_t may_hold(const Words& words, const std::uint8_t* corners, const V3& point) {
  const auto corner = [&](std::size_t c) HWY_ATTR {
    const auto word = words.at(corners + TetRuns::width * c), mask = hn::Set(I(), 255);
    return V3{hn::ConvertTo(F(), hn::And(word, mask)),
              hn::ConvertTo(F(), hn::And(hn::ShiftRight<8>(word), mask)),
              hn::ConvertTo(F(), hn::And(hn::ShiftRight<16>(word), mask))};
  };
  const V3 a = corner(0), b = corner(1), c = corner(2), d = corner(3);
  const V3 u = minus(b, a), v = minus(c, a), w = minus(d, a), from_a = minus(point, a);
  auto out_of_positive = hn::MaskFromVec(hn::Zero(F())), out_of_inverted = out_of_positive;
  const auto face = [&](const V3& normal, const V3& at) HWY_ATTR {
    const V n = hn::MulAdd(normal.x, at.x, hn::MulAdd(normal.y, at.y, hn::Mul(normal.z, at.z)));
    const V size = hn::Add(hn::Abs(normal.x), hn::Add(hn::Abs(normal.y), hn::Abs(normal.z)));
    const V margin = hn::MulAdd(size, all(kStep), all(1));
    out_of_positive = hn::Or(out_of_positive, hn::Lt(n, hn::Neg(margin)));
    out_of_inverted = hn::Or(out_of_inverted, hn::Gt(n, margin));
  };
  const V3 vw = cross(v, w), wu = cross(w, u), uv = cross(u, v);
  face(vw, from_a);
  face(wu, from_a);
  face(uv, from_a);
  face(plus(vw, plus(wu, uv)), minus(b, point));
  return ~bits_of(hn::And(out_of_positive, out_of_inverted)) & ((1U << hn::Lanes(F())) - 1);
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
