// SPDX-License-Identifier: Apache-2.0
// Trilinear samples of places at rest, as many at a time as the sampler takes at once.
#pragma once

#include <cmath>
#include <cstdint>

#include "runtime/spheres/balls.hpp"
#include "runtime/volume/sample_batch.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {

/// One thread's. What was added last may wait until flush().
class PlaceBatch {
 public:
  explicit PlaceBatch(const BatchSink& sink) : sink_(sink), batch_() {}

  /// Voxel `offset` of the posed image shows the volume at index `at`.
  void add(std::size_t offset, const Vec3& at) {
    const std::size_t n = batch_.count;
    batch_.offset[n] = static_cast<std::uint32_t>(offset);
    for (std::size_t a = 0; a < 3; ++a) {
      batch_.base[a][n] = index_below(at[a]);
      batch_.part[a][n] = static_cast<float>(at[a] - batch_.base[a][n]);
    }
    if (++batch_.count == VoxelBatch::capacity) flush();
  }
  void flush() {
    if (batch_.count > 0) sink_.sample(sink_.to, batch_);
    batch_.count = 0;
  }

 private:
  BatchSink sink_;
  VoxelBatch batch_;
};

}  // namespace ecorche::runtime
