// SPDX-License-Identifier: Apache-2.0
// How many tets a body is worth.
#pragma once

#include <cstdint>

#include <ecorche/values/case.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::tet {

/// As many as show what the case holds: two and a half for each vertex of its surfaces (Sujar18's largest
/// model has 1.28 M and 2.3 to 2.8 M), or one cube of twelve for each 3 x 3 x 3 voxels of the body in its
/// finest image, whichever is more. At least 300 000: below, thin bones lose more than 4 % of their volume to
/// tets that two of them share. At most 3 500 000, half as many again as Sujar18's largest mesh. `labels` is
/// of voxel::voxelize. O(voxels).
std::int64_t default_tets(const Case& patient, const Image& labels);

inline constexpr std::int64_t least_default_tets = 300'000, most_default_tets = 3'500'000;

}  // namespace ecorche::tet
