// SPDX-License-Identifier: Apache-2.0
// A motion clip played on a rig, joint by joint name.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/values/pose.hpp"
#include "core/values/skeleton.hpp"

namespace ecorche::kinematics {

/// Which clip joint moves which segment. Names are compared without case, spaces, '_' and ':' prefixes; a
/// segment's own name, its joint's name and its aliases count.
struct Retarget {
  std::vector<int> clip_joint;  ///< #segments; -1 where the clip has none: follows its parent
  std::vector<Eigen::Quaterniond>
      alignment;                            ///< #segments, from the scan to the clip's zero pose (align_rest)
  std::vector<std::string> unused_joints;   ///< clip joints that move nothing (end sites excepted)
  std::vector<std::string> still_segments;  ///< segments that no clip joint moves
};

/// Throws Error{data} when nothing matches, naming both sides' joints.
Retarget match(const Rig& rig, const Clip& clip);

/// The pose of `rig` at a frame: global turns of the clip's joints become turns of the segments, so that clip
/// joints without a segment are folded into their descendants; the root's translation is its way from its own
/// zero offset. Not clamped: see angles.hpp.
Pose pose_at(const Rig& rig, const Clip& clip, const Retarget& retarget, std::size_t frame);

}  // namespace ecorche::kinematics
