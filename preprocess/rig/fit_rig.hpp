// SPDX-License-Identifier: Apache-2.0
// Joint centres from the bones (Sujar18 3.1).
#pragma once

#include "core/values/case.hpp"
#include "core/values/context.hpp"
#include "core/values/skeleton.hpp"

namespace ecorche::rig {

/// Keeps given centres; for `sphere_fit` takes the vertices of `center_bone` that face `facing_bone` (found
/// by proximity), and fits a sphere by RANSAC and a least-squares refinement on the inliers. A residual above
/// 10 % of the radius, or fewer than half inliers, is a warning with the number. A segment of the skeleton
/// that owns no bone is dropped into its nearest present ancestor, with a warning that names both (the root
/// stays). Throws Error{config} when a joint names an absent bone, or when no segment owns a bone, and
/// Error{data} when the facing vertices lie on no sphere.
Rig fit(const Case& patient, const Context& context);

}  // namespace ecorche::rig
