// SPDX-License-Identifier: Apache-2.0
// Nearest samples, a vector of voxels at a time: indices are worked out together, values copied one by one (a
// gather of bytes and a scatter of them cost more).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/sample_nearest.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

// The background as the volume's own type holds it; kBytes of it.
inline void write_background(const SampleJob& job, std::byte* out) {
  with_scalar_type(job.volume.type, [&](auto zero) {
    const auto value = to_scalar<decltype(zero)>(job.background);
    std::memcpy(out, &value, sizeof value);
  });
}

template <std::size_t kBytes>
HWY_INLINE void copy(const std::byte* from, std::byte* to) {
  std::memcpy(to, from, kBytes);
}

template <std::size_t kBytes>
HWY_INLINE void nearest(const void* to, const VoxelBatch& batch) {
  const auto& job = *static_cast<const SampleJob*>(to);
  const ImageGrid& grid = job.volume.grid;
  const std::byte* values = job.volume.bytes.data();
  std::byte* posed = job.posed.bytes.data();
  std::byte background[sizeof(double)];
  write_background(job, background);
  const std::size_t lanes = hn::Lanes(F());
  const VI row = hn::Set(I(), grid.size[0]), rows = hn::Set(I(), grid.size[1]);
  for (std::size_t i = 0; i < batch.count; i += lanes) {
    VI at[3];
    auto inside = hn::MaskFromVec(hn::Set(I(), -1));
    for (std::size_t a = 0; a < 3; ++a) {
      // Floor of place + 1/2 without rounding a sum: a half up is exact, what is left of a part need not be.
      const V part = hn::Load(F(), &batch.part[a][i]), whole = hn::Floor(part);
      const auto up = hn::Ge(part, hn::Add(whole, hn::Set(F(), 0.5F)));
      const VI one = hn::IfThenElseZero(hn::RebindMask(I(), up), hn::Set(I(), 1));
      at[a] = hn::Add(hn::Add(hn::Load(I(), &batch.base[a][i]), truncated(whole)), one);
      inside = hn::And(inside,
                       hn::And(hn::Gt(at[a], hn::Set(I(), -1)), hn::Lt(at[a], hn::Set(I(), grid.size[a]))));
    }
    const VI offset = hn::Add(at[0], hn::Mul(hn::Add(at[1], hn::Mul(at[2], rows)), row));
    HWY_ALIGN std::int32_t from[kMostLanes];
    hn::Store(hn::IfThenElse(inside, offset, hn::Set(I(), -1)), I(), from);
    const std::size_t count = std::min(lanes, batch.count - i);
    if (HWY_LIKELY(count == lanes && hn::AllTrue(I(), inside))) {
      for (std::size_t l = 0; l < lanes; ++l)
        copy<kBytes>(values + kBytes * static_cast<std::size_t>(from[l]),
                     posed + kBytes * batch.offset[i + l]);
      continue;
    }
    // Beyond `count` the batch holds old voxels.
    for (std::size_t l = 0; l < count; ++l) {
      const std::byte* value = from[l] < 0 ? background : values + kBytes * static_cast<std::size_t>(from[l]);
      copy<kBytes>(value, posed + kBytes * batch.offset[i + l]);
    }
  }
}

void nearest_1(const void* job, const VoxelBatch& batch) {
  nearest<1>(job, batch);
}
void nearest_2(const void* job, const VoxelBatch& batch) {
  nearest<2>(job, batch);
}
void nearest_4(const void* job, const VoxelBatch& batch) {
  nearest<4>(job, batch);
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(nearest_1);
HWY_EXPORT(nearest_2);
HWY_EXPORT(nearest_4);

void nearest_1(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(nearest_1)(job, batch);
}
void nearest_2(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(nearest_2)(job, batch);
}
void nearest_4(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(nearest_4)(job, batch);
}

}  // namespace ecorche::runtime::kernels
#endif
