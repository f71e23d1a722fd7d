// SPDX-License-Identifier: Apache-2.0
// From the scan's pose to a clip's zero pose.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/values/pose.hpp"
#include "core/values/skeleton.hpp"

namespace ecorche::kinematics {

/// Where a joint of the clip is in its zero pose, mm LPS; the origin for -1.
Eigen::Vector3d zero_point(const Clip& clip, int joint);

/// Global turns, one a segment, that bring the scanned rest pose to the clip's zero pose: a motion file's
/// zero pose is its maker's (often arms out, or legs apart), the scan's is how the patient lay. Down the
/// tree, a segment first takes its parent's turn; where it is a limb, so that its direction means the same
/// thing in both, it is then turned the shortest way onto the clip's direction. A limb has one child, which
/// the clip moves too, at least 12 % of the skeleton's extent away: shorter segments (clavicle, hand, foot)
/// and those with several children (pelvis, chest) have directions that are the maker's choice. Differences
/// below 5 degrees are anatomy, and left. `clip_joint`: as in Retarget.
std::vector<Eigen::Quaterniond> align_rest(const Rig& rig, const Clip& clip,
                                           const std::vector<int>& clip_joint);

}  // namespace ecorche::kinematics
