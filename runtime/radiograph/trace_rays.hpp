// SPDX-License-Identifier: Apache-2.0
// What the kernel that follows rays through a volume reads.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ecorche::runtime {

/// A volume as seen by rays that run fastest along one of its axes: `along`; the other two are `u` and `v`,
/// u the one of the smaller stride.
struct RayVolume {
  const std::uint16_t* steps = nullptr;
  std::int32_t along = 0, u = 0, v = 0;  ///< strides, in voxels
  float most_u = 0, most_v = 0;          ///< largest index from which a cell's far corner is still there
};

/// Rays that neighbour each other. Ray r crosses plane n at indices (u + n * du, v + n * dv), on planes
/// first .. last, of both of which it has at least 0.
struct RayBatch {
  static constexpr std::size_t most = 16;
  std::size_t count = 0;
  alignas(64) float u[most], du[most], v[most], dv[most];
  alignas(64) float first[most], last[most];
  std::int32_t first_of_all = 0, last_of_all = -1;
};

namespace kernels {
/// Adds to the sum of every ray what it meets on its planes: RayBatch::most numbers, in steps.
void trace_rays(const RayVolume& volume, const RayBatch& rays, float* sums);
}  // namespace kernels

}  // namespace ecorche::runtime
