// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::bench {

/// Every frame of a `.bvh`, `.amc`, `.gltf` or `.glb` clip as a pose of `rig`, aligned at the clip's zero
/// pose. Throws as io::open_clip and kinematics::match.
std::vector<Pose> clip_poses(const std::filesystem::path& clip, const Rig& rig);

}  // namespace ecorche::bench
