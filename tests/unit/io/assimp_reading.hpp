// SPDX-License-Identifier: Apache-2.0
// What assimp makes of a BVH: the second opinion on ours.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace ecorche::foreign {

struct AssimpMotion {
  /// Per joint, one local rotation a frame, in the file's frame.
  std::map<std::string, std::vector<Eigen::Quaterniond>> rotation;
  std::map<std::string, std::vector<Eigen::Vector3d>> position;
};
AssimpMotion assimp_motion(const std::filesystem::path& path);

}  // namespace ecorche::foreign
