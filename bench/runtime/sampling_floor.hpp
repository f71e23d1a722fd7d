// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ecorche/runtime/resample.hpp>
#include <ecorche/values/model.hpp>
#include "bench/runtime/figure.hpp"

namespace ecorche::bench {

/// Every voxel of `region` sampled where it lies, as though nothing had to be inverted: what no inverse map
/// can go below with these kernels.
Figure samples_alone(const ModelVolume& volume, runtime::Sampling sampling, const ImageGrid& region);

/// The region's bytes copied from one array to another.
Figure copy_alone(const ModelVolume& volume, const ImageGrid& region);

}  // namespace ecorche::bench
