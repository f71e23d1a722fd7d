// SPDX-License-Identifier: Apache-2.0
// Trilinear samples of 8 and 16 bit volumes, a vector of voxels at a time: two neighbours in a row come in
// one gather.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/sample_trilinear.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>

#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The value at `offset` and the next one along x, in one load of 32 bits.
template <class T>
HWY_INLINE void load_pair(const T* values, VI offset, V& left, V& right) {
  const VI both = hn::GatherOffset(I(), reinterpret_cast<const std::int32_t*>(values),
                                   sizeof(T) == 2 ? hn::Add(offset, offset) : offset);
  VI low, high;
  if constexpr (sizeof(T) == 1) {
    low = hn::And(both, hn::Set(I(), 0xff));
    high = hn::And(hn::ShiftRight<8>(both), hn::Set(I(), 0xff));
  } else if constexpr (std::is_signed_v<T>) {
    low = hn::ShiftRight<16>(hn::ShiftLeft<16>(both));
    high = hn::ShiftRight<16>(both);
  } else {
    low = hn::And(both, hn::Set(I(), 0xffff));
    high = hn::And(hn::ShiftRight<16>(both), hn::Set(I(), 0xffff));
  }
  left = hn::ConvertTo(F(), low);
  right = hn::ConvertTo(F(), high);
}

HWY_INLINE V between(V a, V b, V share) {
  return hn::MulAdd(share, hn::Sub(b, a), a);
}

template <class T>
void trilinear(const void* to, const VoxelBatch& batch) {
  const auto& job = *static_cast<const SampleJob*>(to);
  const ImageGrid& grid = job.volume.grid;
  const Sampler<T> slow{grid, job.volume.scalars<T>(), 1, job.background};
  const T* values = slow.values.data();
  T* posed = job.posed.scalars<T>().data();
  const std::int32_t row = grid.size[0], slice = grid.size[0] * grid.size[1];
  // The last pairs would be loaded beyond the image's end.
  const auto reach = static_cast<std::int32_t>(slow.values.size()) - 4 - row - slice;
  const std::size_t lanes = hn::Lanes(F());
  for (std::size_t i = 0; i < batch.count; i += lanes) {
    // Beyond `count` the batch holds old voxels, which are computed and not written.
    VI at[3];
    V share[3];
    auto fast = hn::MaskFromVec(hn::BitCast(F(), hn::Set(I(), -1)));
    for (std::size_t a = 0; a < 3; ++a) {
      const V part = hn::Load(F(), &batch.part[a][i]), whole = hn::Floor(part);
      share[a] = hn::Sub(part, whole);
      at[a] = hn::Add(hn::Load(I(), &batch.base[a][i]), truncated(whole));
      const auto inside =
          hn::And(hn::Gt(at[a], hn::Set(I(), -1)), hn::Lt(at[a], hn::Set(I(), grid.size[a] - 1)));
      fast = hn::And(fast, hn::RebindMask(F(), inside));
    }
    VI offset = hn::Add(
        at[0], hn::Mul(hn::Add(at[1], hn::Mul(at[2], hn::Set(I(), grid.size[1]))), hn::Set(I(), row)));
    fast = hn::And(fast, hn::RebindMask(F(), hn::Lt(offset, hn::Set(I(), reach))));
    offset = hn::IfThenElseZero(hn::RebindMask(I(), fast), offset);
    V sum;
    {
      V a, b, c, d, e, f, g, h;
      load_pair(values, offset, a, b);
      load_pair(values, hn::Add(offset, hn::Set(I(), row)), c, d);
      load_pair(values, hn::Add(offset, hn::Set(I(), slice)), e, f);
      load_pair(values, hn::Add(offset, hn::Set(I(), row + slice)), g, h);
      sum = between(between(between(a, b, share[0]), between(c, d, share[0]), share[1]),
                    between(between(e, f, share[0]), between(g, h, share[0]), share[1]), share[2]);
    }
    // Half away from zero, as to_scalar.
    sum = hn::Add(sum, hn::CopySign(hn::Set(F(), 0.5F), sum));
    HWY_ALIGN std::int32_t value[kMostLanes], easy[kMostLanes];
    hn::Store(truncated(sum), I(), value);
    const std::size_t count = std::min(lanes, batch.count - i);
    if (HWY_LIKELY(count == lanes && hn::AllTrue(F(), fast))) {
      for (std::size_t l = 0; l < lanes; ++l) posed[batch.offset[i + l]] = static_cast<T>(value[l]);
      continue;
    }
    hn::Store(hn::BitCast(I(), hn::VecFromMask(F(), fast)), I(), easy);
    for (std::size_t l = 0; l < count; ++l) {
      T* voxel = &posed[batch.offset[i + l]];
      if (easy[l] != 0) {
        *voxel = static_cast<T>(value[l]);
      } else {
        const auto place = [&](std::size_t a) {
          return batch.base[a][i + l] + static_cast<double>(batch.part[a][i + l]);
        };
        slow.trilinear(place(0), place(1), place(2), voxel);
      }
    }
  }
}

void trilinear_u8(const void* job, const VoxelBatch& batch) {
  trilinear<std::uint8_t>(job, batch);
}
void trilinear_u16(const void* job, const VoxelBatch& batch) {
  trilinear<std::uint16_t>(job, batch);
}
void trilinear_i16(const void* job, const VoxelBatch& batch) {
  trilinear<std::int16_t>(job, batch);
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(trilinear_u8);
HWY_EXPORT(trilinear_u16);
HWY_EXPORT(trilinear_i16);

bool gathers_reach(const Image& volume) {
  // Offsets in bytes are 32 bits; and a first pair must be there to be loaded for nothing.
  constexpr std::size_t most = std::size_t{1} << 31;
  return volume.bytes.size() < most && volume.grid.voxels() >= 4 && volume.grid.size[0] >= 2 &&
         static_cast<std::size_t>(volume.grid.size[0]) * static_cast<std::size_t>(volume.grid.size[1]) +
                 static_cast<std::size_t>(volume.grid.size[0]) + 4 <=
             volume.grid.voxels();
}

void trilinear_u8(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(trilinear_u8)(job, batch);
}
void trilinear_u16(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(trilinear_u16)(job, batch);
}
void trilinear_i16(const void* job, const VoxelBatch& batch) {
  HWY_DYNAMIC_DISPATCH(trilinear_i16)(job, batch);
}

}  // namespace ecorche::runtime::kernels
#endif
