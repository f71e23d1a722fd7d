// SPDX-License-Identifier: Apache-2.0
// Hanging skeletal voxels where the tets say: past Gagvani01 4, whose lines from joint to joint draw the
// flank to the arm that lies beside it.
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::thin {

/// The segment whose skinning weight is largest at each voxel's centre, among equals the first: harmonic
/// weights spread from the bones through the flesh, so that a rib holds the flank. A centre outside the tets
/// follows the nearest of them, as tissues do. `model`: nodes, tets and weights are read. One a voxel.
std::vector<std::int32_t> attach_by_weights(const VolumetricSkeleton& skeleton, const Model& model,
                                            const Context& context);

}  // namespace ecorche::thin
