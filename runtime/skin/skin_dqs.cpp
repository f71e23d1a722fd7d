// SPDX-License-Identifier: Apache-2.0
// Dual quaternion skinning (Kavan08, dual quaternion linear blending), a vector of nodes at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/skin_dqs.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include "runtime/skin/quaternions-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

// The vector part of 2 dual real*: the translation of the blended motion (Kavan08 alg. 1).
HWY_INLINE V3 translation(const Quaternion& real, const Quaternion& dual) {
  const V3 vector = minus(times(dual.r, real.w), times(real.r, dual.w));
  return times(plus(vector, cross(real.r, dual.r)), all(2));
}

void skin_dqs(const SkinClusters& job, std::size_t begin, std::size_t end) {
  const V3 origin = all3(job.root.origin);
  const SegmentMotion* motions = job.motions.data();
  for_clusters<false>(job, begin, end, [&](const Cluster& cluster, std::size_t, const V3& x) HWY_ATTR {
    Quaternion real = zero_quaternion(), dual = zero_quaternion();
    for (std::size_t k = 0; k < cluster.count; ++k) {
      const SegmentMotion& motion = motions[cluster.segments[k]];
      const V w = load_u16(cluster.weights + NodeClusters::size * k);
      add(motion.real, w, real);
      add(motion.dual, w, dual);
    }
    const V squared = squared_length(real);
    const V scale = inverse_root(squared);
    real = scaled(real, scale);
    dual = scaled(dual, scale);
    if (HWY_UNLIKELY(any_vanished(squared))) {
      replace_vanished(motions, cluster, squared, &SegmentMotion::real, real);
      replace_vanished(motions, cluster, squared, &SegmentMotion::dual, dual);
    }
    return plus(turn_less_identity(real.w, real.r, minus(x, origin)), translation(real, dual));
  });
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(skin_dqs);

void dqs(const SkinClusters& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(skin_dqs)(job, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
