// SPDX-License-Identifier: Apache-2.0
// Keyframes: poses at times, in a file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/kinematics/interpolate.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::io {

struct PoseSequence {
  std::string name;  ///< of the file
  double frame_seconds = 1.0 / 30;
  kinematics::PoseKeys keys;
  std::vector<std::string> left_out;  ///< `joint.angle` of library poses that the rig has not

  std::size_t frames() const;
  Pose at(std::size_t frame) const;
};

/// A pose sequence (docs/reference/motion.md): keys in ascending `time_s`, each a pose file beside it, a pose
/// of the library or joints of its own. Throws Error{config} for whatever is wrong in it, naming file, line
/// and key, and what read_pose throws.
PoseSequence read_pose_sequence(const std::filesystem::path& path, const Rig& rig);

}  // namespace ecorche::io
