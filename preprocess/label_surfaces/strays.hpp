// SPDX-License-Identifier: Apache-2.0
// Labels of which nothing is left but stray voxels off the body.
#pragma once

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::label_surfaces {

/// Fewer voxels off the body than this are taken for a slip of the pen: a block of 4 a side.
inline constexpr std::int64_t kStray = 64;

/// What to do with entries whose source gave no surface although their labels have voxels: those lie off the
/// body. A tissue of at most kStray of them goes, with a warning that names it, its voxels and the first
/// one's place. Throws Error{config}, with the same, for any other, and for a source that has no voxel at all
/// on its side and within its image.
void drop_strays(Case& patient, const Context& context);

}  // namespace ecorche::label_surfaces
