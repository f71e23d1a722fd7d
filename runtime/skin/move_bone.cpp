// SPDX-License-Identifier: Apache-2.0
// Vertices of a bone, a vector at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/skin/move_bone.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include "runtime/skin/sink-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

// `count` rows of three from row `first`; the lanes beyond them hold anything.
HWY_INLINE V3 load_rows(const float* rows, std::size_t first, std::size_t count) {
  V3 v;
  if (HWY_LIKELY(count == hn::Lanes(F()))) {
    hn::LoadInterleaved3(F(), rows + 3 * first, v.x, v.y, v.z);
    return v;
  }
  HWY_ALIGN float copy[3 * 16] = {};
  std::memcpy(copy, rows + 3 * first, 3 * count * sizeof(float));
  hn::LoadInterleaved3(F(), copy, v.x, v.y, v.z);
  return v;
}

void move_bone(const BoneVertices& job, std::size_t begin, std::size_t end) {
  const Way way(job.motion);
  const Sink sink(job.out);
  const V3 origin = all3(job.motion.origin);
  for (std::size_t v = begin; v < end; v += hn::Lanes(F())) {
    const Places places{v, std::min(end - v, hn::Lanes(F())), nullptr};
    const V3 x = load_rows(job.rest.data(), v, places.count);
    sink.put_position(places, way.carry(x, matrix_times(job.motion.turn.data(), minus(x, origin))));
    if (job.out.normals == nullptr) continue;
    const V3 n = load_rows(job.normals.data(), v, places.count);
    sink.put_normal(places, plus(n, matrix_times(job.motion.turn.data(), n)), hn::Eq(n.x, n.x));
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(move_bone);

void bone(const BoneVertices& job, std::size_t begin, std::size_t end) {
  HWY_DYNAMIC_DISPATCH(move_bone)(job, begin, end);
}

}  // namespace ecorche::runtime::kernels
#endif
