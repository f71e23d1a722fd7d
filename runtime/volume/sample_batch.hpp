// SPDX-License-Identifier: Apache-2.0
// Values for a batch of drawn voxels.
#pragma once

#include <cstdint>

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/image.hpp>
#include "runtime/volume/draw_tets.hpp"

namespace ecorche::runtime {

/// Where batches are sampled from and written to; `posed` has the type and components of `volume`.
struct SampleJob {
  const Image& volume;
  double background = 0;
  Image& posed;
};

/// A sink for `job`, which must outlive it. Nearest copies, to the byte as Sampler does; trilinear as Sampler
/// does, for one component of u8, u16 or i16 a vector at a time in float32: within 1e-4 of the value's range
/// of Sampler's doubles.
BatchSink sink_for(const SampleJob& job, Sampling sampling);

namespace kernels {
/// One component; trilinear. False: not for this image (its bytes are out of reach of 32-bit gathers).
bool gathers_reach(const Image& volume);
void trilinear_u8(const void* job, const VoxelBatch& batch);
void trilinear_u16(const void* job, const VoxelBatch& batch);
void trilinear_i16(const void* job, const VoxelBatch& batch);
/// One component of so many bytes; nearest. The volume has fewer than 2^31 voxels.
void nearest_1(const void* job, const VoxelBatch& batch);
void nearest_2(const void* job, const VoxelBatch& batch);
void nearest_4(const void* job, const VoxelBatch& batch);
}  // namespace kernels

}  // namespace ecorche::runtime
