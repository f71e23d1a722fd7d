// SPDX-License-Identifier: Apache-2.0
// Poses of a rig as a clip on its own joints.
#pragma once

#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::kinematics {

/// A clip without frames whose joints are the rig's segments, by name, in the scanned pose: its zero pose is
/// the scan.
Clip rig_clip(const Rig& rig, const std::string& name, double frame_seconds);

/// Appends a frame that moves the clip's joints as `forward` moves the segments. Translations of joints other
/// than the root have no place in a clip; false where the pose has one.
bool add_frame(const Rig& rig, const Pose& pose, Clip& clip);

}  // namespace ecorche::kinematics
