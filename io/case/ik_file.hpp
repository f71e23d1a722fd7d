// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics as a file asks for it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <ecorche/kinematics/ik.hpp>
#include <ecorche/values/skeleton.hpp>

namespace ecorche::io {

struct IkRequest {
  Pose start;
  kinematics::IkProblem problem;
  std::vector<std::string> names;     ///< of targets, then of looks, for messages
  std::vector<std::string> left_out;  ///< of a library pose that the rig has not
};

/// `ecorche_ik: 1` (docs/reference/motion.md): where to start, what is pinned, targets and looks. Throws
/// Error{config} naming file, line and key, and what read_pose and library_pose throw.
IkRequest read_ik(const std::filesystem::path& path, const Rig& rig);

}  // namespace ecorche::io
