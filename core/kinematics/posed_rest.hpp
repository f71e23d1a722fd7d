// SPDX-License-Identifier: Apache-2.0
// A pose as the rest pose of another scan.
#pragma once

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// The skeleton of the body that stands as `pose` says, as if it had been scanned so: centres and axes
/// carried along by their segments, every anatomical angle at rest what it is in the pose, so that the same
/// named angles mean the same stance for both. With r the rotation of a joint in the pose, a rotation r' of
/// the result is r * r' of `rig`. Limits, couplings (which count from rest; slides go on along the parent's
/// own directions) and names stay. `pose` must have
/// passed `constrain`. Throws as `forward` and `angles_from_rotation` do.
Skeleton posed_rest(const Rig& rig, const Pose& pose);

}  // namespace ecorche::kinematics
