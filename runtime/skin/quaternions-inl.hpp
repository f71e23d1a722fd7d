// SPDX-License-Identifier: Apache-2.0
// Blended quaternions, once per instruction set.
#if defined(ECORCHE_RUNTIME_SKIN_QUATERNIONS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_QUATERNIONS_INL
#undef ECORCHE_RUNTIME_SKIN_QUATERNIONS_INL
#else
#define ECORCHE_RUNTIME_SKIN_QUATERNIONS_INL
#endif

#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

struct Quaternion {
  V w;
  V3 r;
};

HWY_INLINE Quaternion zero_quaternion() {
  const V zero = hn::Zero(F());
  return {zero, {zero, zero, zero}};
}

HWY_INLINE void add(const std::array<float, 4>& q, V w, Quaternion& sum) {
  sum.w = hn::MulAdd(w, all(q[0]), sum.w);
  sum.r.x = hn::MulAdd(w, all(q[1]), sum.r.x);
  sum.r.y = hn::MulAdd(w, all(q[2]), sum.r.y);
  sum.r.z = hn::MulAdd(w, all(q[3]), sum.r.z);
}

HWY_INLINE Quaternion scaled(const Quaternion& q, V factor) {
  return {hn::Mul(q.w, factor), times(q.r, factor)};
}

HWY_INLINE V squared_length(const Quaternion& q) {
  return hn::MulAdd(q.w, q.w, hn::MulAdd(q.r.x, q.r.x, hn::MulAdd(q.r.y, q.r.y, hn::Mul(q.r.z, q.r.z))));
}

/// Of a blend by weights in 65535ths.
inline constexpr float vanished_squared = (vanished_blend * whole) * (vanished_blend * whole);

HWY_INLINE bool any_vanished(V squared) {
  return !hn::AllFalse(F(), hn::Lt(squared, all(vanished_squared)));
}

/// Lanes whose blend vanished take the quaternion of their heaviest segment. Rare, so plain code.
inline HWY_NOINLINE void replace_vanished(const SegmentMotion* motions, const Cluster& cluster, V squared,
                                          std::array<float, 4> SegmentMotion::*part, Quaternion& q) {
  HWY_ALIGN float length[16], w[16], x[16], y[16], z[16];
  hn::Store(squared, F(), length);
  hn::Store(q.w, F(), w);
  hn::Store(q.r.x, F(), x);
  hn::Store(q.r.y, F(), y);
  hn::Store(q.r.z, F(), z);
  for (std::size_t lane = 0; lane < hn::Lanes(F()); ++lane) {
    if (!(length[lane] < vanished_squared)) continue;
    const std::array<float, 4>& follow = motions[heaviest(cluster, lane)].*part;
    w[lane] = follow[0];
    x[lane] = follow[1];
    y[lane] = follow[2];
    z[lane] = follow[3];
  }
  q = {hn::Load(F(), w), {hn::Load(F(), x), hn::Load(F(), y), hn::Load(F(), z)}};
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
