// SPDX-License-Identifier: Apache-2.0
// What must hold in every model, so that nothing after the reader has to ask again.
#pragma once

#include <string>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::model_file {

/// Throws Error{kind, WHERE:DATASET} at the first invariant that does not hold: sizes agree, indices are in
/// range, values are finite; parents come first; names are unique identifiers; joint frames and image
/// directions are orthonormal; tets are positive; weight rows are sorted, lie in [0, 1] and sum to 1 within
/// 1e-6; barycentric coordinates sum to 1 within 1e-4; spheres
/// have no defect (`first_defect`), a tree, and a segment for every voxel. Linear in the size of the model.
void check_invariants(const Model& model, const std::string& where, ErrorKind kind, const Context& context);

}  // namespace ecorche::model_file
