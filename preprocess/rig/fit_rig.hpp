// SPDX-License-Identifier: Apache-2.0
// Joint centres from the bones (Sujar18 3.1).
#pragma once

#include <string_view>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/skeleton.hpp>
#include "preprocess/rig/joint_evidence.hpp"

namespace ecorche::rig {

/// What every warning of a joint ends with, in brackets: what to do about it.
inline constexpr std::string_view joint_advice =
    "give its center and axes in the skeleton, or mend the bones that it was found on";

/// Keeps given centres and axes, and finds the others by their rules (joint_sources.hpp), on the vertices of
/// named regions or on those that face another bone, found by proximity. What is found badly is a warning
/// with its number: a sphere between two bones with a residual above 10 % of the radius or fewer than half
/// inliers, anything else below half confidence; so is a rule that cannot be followed, whose joint then lies
/// where its segment is nearest to the parent's bones. Measured rest angles are those from the parent's axes
/// to the joint's; a limit that leaves them out is widened to them, with a warning. A segment of the skeleton
/// that owns no bone is dropped into its nearest present ancestor, with a warning that names both (the root
/// stays). A generic case gets the tree of generic_tree.hpp. Throws Error{config} when a sphere fit between
/// two bones names an absent one, when rules go in a circle, or when no segment owns a bone, and Error{data}
/// when such a sphere fit finds none, or axes come out collinear. `evidence`, if not null, gets one per
/// joint.
Rig fit(const Case& patient, const Context& outer, std::vector<JointEvidence>* evidence = nullptr);

}  // namespace ecorche::rig
