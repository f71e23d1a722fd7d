// SPDX-License-Identifier: Apache-2.0
// How far what a joint's rule found is to be believed, beside the rest of the body.
#pragma once

#include <ecorche/values/context.hpp>
#include "preprocess/rig/joint_sources.hpp"

namespace ecorche::rig {

/// 1, or less where a hinge's centre lies far from the bones that hang on it, though they are there, and its
/// parent's bone is too short to show a shaft that its axis should cross: a cylinder was fitted to the end
/// where that was cut. By half where that is a fifth of the
/// size of those bones. Warns where it is under a half.
double far_off(JointSources& sources, const Skeleton& skeleton, std::size_t row,
               const Eigen::Vector3d& center, const Context& context);

/// 1, or less where axes that the rule takes from the scan's own, [1, 0, 0] for left or [0, 0, 1] for up, are
/// those of a body that lies askew in it: by half where the trunk (else the thighs, else the shanks, from
/// what has confidence 0.5 or more, the neck 0.2) is 12 degrees beyond a lying person's usual slope. Warns
/// where it is under a half.
double tilted_by(JointSources& sources, const Skeleton& skeleton, std::size_t row, const Context& context);

}  // namespace ecorche::rig
