// SPDX-License-Identifier: Apache-2.0
// Linear blend skinning, a vector of nodes at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/skin_lbs.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include "runtime/skin/vectors-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

void skin_lbs(const SkinClusters& job, std::size_t begin, std::size_t end) {
  const V3 origin = all3(job.root.origin);
  for_clusters<false>(job, begin, end, [&](const Cluster& cluster, std::size_t, const V3& x) HWY_ATTR {
    return times(blend_displacements(job.motions.data(), cluster, minus(x, origin)), all(1 / whole));
  });
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(skin_lbs);

void lbs(const SkinClusters& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(skin_lbs)(job, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
