// SPDX-License-Identifier: Apache-2.0
// What caps leave open of a skin that was cut.
#pragma once

#include <cstdint>
#include <set>

#include "preprocess/parting/parted_tets.hpp"

namespace ecorche::parting {

/// About `rim`, the vertices of rims and caps, sheets that meet are told apart, and holes are filled where
/// they are of one side, or of two that hang together there. Triangles that hang on no other go, but for
/// those of the skin's first `own` vertices.
void fill_gaps(Tissue& skin, const std::set<std::int32_t>& rim, Eigen::Index own, const PartedTets& tets,
               const Context& context);

}  // namespace ecorche::parting
