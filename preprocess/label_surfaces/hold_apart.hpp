// SPDX-License-Identifier: Apache-2.0
// Limbs that touch in the scan what they do not hang on: a gap between them.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::label_surfaces {

/// What was taken out between two segments.
struct RemovedVoxels {
  int a, b;  ///< rows of the skeleton, a < b
  std::int64_t voxels;
};

/// Makes those voxels of the label map 0 that lie too near between limbs and what they do not hang on, as
/// `patient.labels->apart` says, in all layers, and warns of how much that is. Tets that hold flesh of both
/// would be dragged along by either.
///
/// Every labelled voxel is of a segment: that of its bone; elsewhere that of the nearest bone of the limbs
/// whose label it has (their segments and what hangs on them), or, where its label is of no limb, of the
/// nearest other bone. Labels of an entry without segments take no part. Two voxels are strangers where they
/// are of two limbs, or of a limb and of none, and more joints lie between their segments than `joints` (the
/// smaller of two limbs') says. A voxel whose nearest stranger is D mm away (between centres), which has its
/// own nearest at E <= D, goes where D < (gap_mm + E) / 2: both sides give way from the middle, so that plane
/// ones are gap_mm apart. Elsewhere (a hand on a hip) it is about that much.
///
/// Returns what was taken out, by pairs of segments, ascending. Leaves `apart` in place. The same for any
/// number of threads. O(voxels). Throws Error{config} where limbs or the rest have no bone of labels,
/// Error{interrupted}.
std::vector<RemovedVoxels> hold_apart(Case& patient, const Context& context);

}  // namespace ecorche::label_surfaces
