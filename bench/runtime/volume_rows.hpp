// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include <ecorche/values/model.hpp>
#include "bench/runtime/figure.hpp"

namespace ecorche::bench {

/// The model's first volume posed as `nodes` by the slow twins on its own grid, then as 8 and 16 bits on 290
/// x 169 x 940 voxels about its own box, one slice and one region of it. Nothing where the model has no
/// volume.
void time_volumes(const Table& table, const std::shared_ptr<const Model>& model, std::span<const float> nodes,
                  int threads);

/// VTK and ITK beside it, 8 bit, on all of this machine's threads.
void time_volume_peers(const std::shared_ptr<const Model>& model, std::span<const float> nodes);

}  // namespace ecorche::bench
