// SPDX-License-Identifier: Apache-2.0
// Weights of a body, of whose limbs those that touch came apart.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/skeleton.hpp>
#include "preprocess/parting/part_limbs.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::preprocess {

struct PartedWeights {
  weights::WeightsResult solved;  ///< of the mesh as it is then
  parting::Parting parting;       ///< without faces where no limb was cut free
};

/// Solves the weights; where limbs touch by them (check::touching_limbs) and the case does not say that they
/// stay joined, cuts the mesh there and solves anew. Of a body that stands free, `voxels` are not looked at.
PartedWeights parted_weights(const TetMesh& mesh, const Case& patient, const Rig& rig,
                             const std::vector<std::int32_t>& bone_segment, const Image& voxels,
                             const weights::Options& options, const Context& context);

}  // namespace ecorche::preprocess
