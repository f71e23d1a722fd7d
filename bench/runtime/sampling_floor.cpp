// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/sampling_floor.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/volume/sample_batch.hpp"

namespace ecorche::bench {

Figure samples_alone(const ModelVolume& volume, runtime::Sampling sampling, const ImageGrid& region) {
  Image out(region, volume.image.type);
  const runtime::SampleJob job{volume.image, volume.background, out};
  const runtime::BatchSink sink = runtime::sink_for(job, sampling);
  return time(5, [&](int) {
    tbb::parallel_for(std::int32_t{0}, region.size[2], [&](std::int32_t k) {
      runtime::VoxelBatch batch;
      for (std::int32_t j = 0; j < region.size[1]; ++j) {
        const std::array<double, 3> at = volume.image.grid.index(region.point(0, j, k));
        for (std::int32_t i = 0; i < region.size[0]; ++i) {
          if (batch.count == runtime::VoxelBatch::capacity) {
            sink.sample(sink.to, batch);
            batch.count = 0;
          }
          const std::size_t n = batch.count++;
          batch.offset[n] = static_cast<std::uint32_t>(region.offset(i, j, k));
          for (std::size_t a = 0; a < 3; ++a) {
            const auto x = static_cast<float>(at[a]) + (a == 0 ? static_cast<float>(i) + 0.3F : 0.3F);
            batch.base[a][n] = 0;
            batch.part[a][n] = x;
          }
        }
      }
      sink.sample(sink.to, batch);
    });
  });
}

Figure copy_alone(const ModelVolume& volume, const ImageGrid& region) {
  const Image from(region, volume.image.type);
  Image to(region, volume.image.type);
  const std::size_t slice = from.bytes.size() / static_cast<std::size_t>(region.size[2]);
  return time(9, [&](int) {
    tbb::parallel_for(std::int32_t{0}, region.size[2], [&](std::int32_t k) {
      const std::size_t first = slice * static_cast<std::size_t>(k);
      std::memcpy(&to.bytes[first], &from.bytes[first], slice);
    });
  });
}

}  // namespace ecorche::bench
