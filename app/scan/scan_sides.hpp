// SPDX-License-Identifier: Apache-2.0
// Second step: pieces of bones whose labels cover both sides get theirs.
#pragma once

#include <vector>

#include "app/scan/label_names.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::app {

/// Splits entries of limb bones without a side into two, by the pieces of `out.labels` (those without voxels
/// are gone from it already). Pieces whose side cannot be told become nothing, and a doubt with their place.
void give_sides(ScanCase& out, const std::vector<Named>& named, const scan::Pieces& pieces, Side only);

/// What the label of entry `e` became: `femur_left, bone of thigh_left`; where its pieces went to entries
/// with sides, both of those.
std::string fate_in_words(const ScanCase& scan, std::size_t e, bool sides_given);

}  // namespace ecorche::app
