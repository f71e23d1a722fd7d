// SPDX-License-Identifier: Apache-2.0
// The poses that come with ecorche.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::io {

inline constexpr std::string_view library_prefix = "lib:";

/// anatomical, arms_up, lateral, lithotomy, prone, sitting, squatting, supine: io/case/data/poses.yaml.
std::vector<std::string> library_poses();

/// A pose by name, on a rig.
struct LibraryPose {
  Pose pose;
  std::vector<std::string> left_out;  ///< `joint.angle` that the rig has not
};

/// The named pose on any rig: by the names of joints (`hip_left`) and anatomical angles, or what the rig
/// calls the opposite (find_named_angle). Throws Error{usage} for an unknown name, with those that there are,
/// and Error{config} for a rig that has none of the pose's joints.
LibraryPose library_pose(std::string_view name, const Rig& rig);

}  // namespace ecorche::io
