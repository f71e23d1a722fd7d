// SPDX-License-Identifier: Apache-2.0
// `pose --ik`: the pose in which points are at their goals, and how far it misses them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "app/program.hpp"

namespace ecorche::app {

/// Ten times what the solver stops at (IkProblem::tolerance_mm), and about a voxel of the finest CT: a goal
/// missed by more was out of reach, and can be seen in what is posed.
inline constexpr double kMissedMm = 1;

struct SolvedPose {
  Pose pose;
  nlohmann::json report;  ///< root, angles, and the residual of every target and look
  /// One for each goal beyond the tolerance, a look at 200 mm: as those of quality.json.
  nlohmann::json warnings = nlohmann::json::array();
};

/// Notes how near each goal within `tolerance_mm` is; the others, with where they came to and what helps, are
/// returned. Throws as io::read_ik.
SolvedPose solve_pose(const Program& program, const std::filesystem::path& file, const Rig& rig,
                      double tolerance_mm);

}  // namespace ecorche::app
