// SPDX-License-Identifier: Apache-2.0
// A vector of rays at a time through planes of voxels (Joseph82): two neighbours come in one gather.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/radiograph/trace_rays.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include "runtime/radiograph/trace_rays.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Batches are of sixteen rays.
using Floats = hn::CappedTag<float, RayBatch::most>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using I = hn::Vec<Ints>;

HWY_INLINE F between(F a, F b, F share) {
  return hn::MulAdd(share, hn::Sub(b, a), a);
}

HWY_INLINE F low_half(I both) {
  return hn::ConvertTo(Floats(), hn::And(both, hn::Set(Ints(), 0xffff)));
}

HWY_INLINE I load(const std::uint16_t* at, I offset) {
  return hn::GatherOffset(Ints(), reinterpret_cast<const std::int32_t*>(at), hn::Add(offset, offset));
}

// Between the voxel at `offset` and its neighbour along u.
template <bool kNext>
HWY_INLINE F along_u(const std::uint16_t* plane, I offset, I stride, F share) {
  const I here = load(plane, offset);
  if constexpr (kNext) {
    const F there = hn::ConvertTo(Floats(), hn::And(hn::ShiftRight<16>(here), hn::Set(Ints(), 0xffff)));
    return between(low_half(here), there, share);
  } else {
    return between(low_half(here), low_half(load(plane, hn::Add(offset, stride))), share);
  }
}

// kNext: neighbours along u lie side by side in memory.
template <bool kNext>
void trace(const RayVolume& volume, const RayBatch& rays, float* sums) {
  const Floats f;
  const Ints i;
  const I stride_u = hn::Set(i, volume.u), stride_v = hn::Set(i, volume.v);
  const F none = hn::Zero(f), most_u = hn::Set(f, volume.most_u), most_v = hn::Set(f, volume.most_v);
  for (std::size_t r = 0; r < rays.count; r += hn::Lanes(f)) {
    const F u0 = hn::Load(f, rays.u + r), du = hn::Load(f, rays.du + r);
    const F v0 = hn::Load(f, rays.v + r), dv = hn::Load(f, rays.dv + r);
    const F first = hn::Load(f, rays.first + r), last = hn::Load(f, rays.last + r);
    F sum = hn::Load(f, sums + r);
    for (std::int32_t n = rays.first_of_all; n <= rays.last_of_all; ++n) {
      const F at = hn::Set(f, static_cast<float>(n));
      // The crop has an empty border: beyond it a ray sees that.
      const F u = hn::Min(hn::Max(hn::MulAdd(at, du, u0), none), most_u);
      const F v = hn::Min(hn::Max(hn::MulAdd(at, dv, v0), none), most_v);
      const I cell_u = hn::ConvertTo(i, u), cell_v = hn::ConvertTo(i, v);
      const F share_u = hn::Sub(u, hn::ConvertTo(f, cell_u)), share_v = hn::Sub(v, hn::ConvertTo(f, cell_v));
      const I offset = kNext ? hn::Add(cell_u, hn::Mul(cell_v, stride_v))
                             : hn::Add(hn::Mul(cell_u, stride_u), hn::Mul(cell_v, stride_v));
      const std::uint16_t* plane = volume.steps + static_cast<std::ptrdiff_t>(n) * volume.along;
      const F near = along_u<kNext>(plane, offset, stride_u, share_u);
      const F far = along_u<kNext>(plane, hn::Add(offset, stride_v), stride_u, share_u);
      const auto crossed = hn::And(hn::Ge(at, first), hn::Le(at, last));
      sum = hn::Add(sum, hn::IfThenElseZero(crossed, between(near, far, share_v)));
    }
    hn::Store(sum, f, sums + r);
  }
}

void trace_rays(const RayVolume& volume, const RayBatch& rays, float* sums) {
  if (volume.u == 1) return trace<true>(volume, rays, sums);
  trace<false>(volume, rays, sums);
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(trace_rays);

void trace_rays(const RayVolume& volume, const RayBatch& rays, float* sums) {
  HWY_DYNAMIC_DISPATCH(trace_rays)(volume, rays, sums);
}

}  // namespace ecorche::runtime::kernels
#endif
