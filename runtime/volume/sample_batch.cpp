// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/sample_batch.hpp"

#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

template <class T, Sampling sampling>
void sample(const void* to, const VoxelBatch& batch) {
  const auto& job = *static_cast<const SampleJob*>(to);
  const auto components = static_cast<std::size_t>(job.volume.components);
  const Sampler<T> from{job.volume.grid, job.volume.scalars<T>(), components, job.background};
  const std::span<T> posed = job.posed.scalars<T>();
  for (std::size_t i = 0; i < batch.count; ++i) {
    const auto at = [&](std::size_t a) { return batch.base[a][i] + static_cast<double>(batch.part[a][i]); };
    T* voxel = &posed[components * batch.offset[i]];
    if constexpr (sampling == Sampling::nearest) {
      // A tet of lower precedence may have been here.
      std::fill_n(voxel, components, to_scalar<T>(job.background));
      from.nearest(at(0), at(1), at(2), voxel);
    } else {
      from.trilinear(at(0), at(1), at(2), voxel);
    }
  }
}

}  // namespace

BatchSink sink_for(const SampleJob& job, Sampling sampling) {
  const ScalarType type = job.volume.type;
  if (sampling == Sampling::trilinear && job.volume.components == 1 && kernels::gathers_reach(job.volume)) {
    if (type == ScalarType::u8) return {kernels::trilinear_u8, &job};
    if (type == ScalarType::u16) return {kernels::trilinear_u16, &job};
    if (type == ScalarType::i16) return {kernels::trilinear_i16, &job};
  }
  constexpr std::size_t most = std::size_t{1} << 31U;
  if (sampling == Sampling::nearest && job.volume.components == 1 && job.volume.grid.voxels() < most) {
    if (scalar_bytes(type) == 1) return {kernels::nearest_1, &job};
    if (scalar_bytes(type) == 2) return {kernels::nearest_2, &job};
    if (scalar_bytes(type) == 4) return {kernels::nearest_4, &job};
  }
  return with_scalar_type(type, [&](auto zero) -> BatchSink {
    using T = decltype(zero);
    if (sampling == Sampling::nearest) return {sample<T, Sampling::nearest>, &job};
    return {sample<T, Sampling::trilinear>, &job};
  });
}

}  // namespace ecorche::runtime
