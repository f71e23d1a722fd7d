// SPDX-License-Identifier: Apache-2.0
// The surfaces of a case as tissues of its model.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "preprocess/parting/part_limbs.hpp"

namespace ecorche::preprocess {

/// Skin first, then bones, then the others: the order of Model::tissues. `bone_segment`: of each bone.
std::vector<Tissue> gather_tissues(const Case& patient, const std::vector<std::int32_t>& bone_segment);

/// Bones go with their segment; what is not bone is bound to the model's tets, from the float32 positions
/// that are stored, and goes with one side each where limbs came apart. Warns of vertices that lie far
/// outside.
std::vector<Tissue> bind_tissues(std::vector<Tissue> tissues, const Model& model,
                                 const parting::Parting& parting, double voxel_mm, const Context& context);

}  // namespace ecorche::preprocess
