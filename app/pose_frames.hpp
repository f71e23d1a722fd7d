// SPDX-License-Identifier: Apache-2.0
// Which poses `ecorche pose` was asked for.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include "app/cli_fwd.hpp"
#include "app/motion_source.hpp"
#include "app/program.hpp"
#include "app/solved_pose.hpp"

namespace ecorche::app {

/// As the command line says it: a pose, goals of points, or frames of a motion.
struct FrameChoice {
  std::string pose;          ///< a pose file, or lib:NAME
  std::filesystem::path ik;  ///< goals of points
  MotionChoice motion;
  std::string frames = {};  ///< A, A:B or A:B:STEP
  double ik_tolerance_mm = kMissedMm;
};

/// Declares the options that fill `choice`, which must live as long as the command.
void add_frame_options(CLI::App& command, FrameChoice& choice);

struct Frame {
  std::string name;  ///< empty for a single pose, which needs no folder of its own
  Pose pose;
  nlohmann::json ik;                                ///< of --ik alone: what was found
  nlohmann::json missed = nlohmann::json::array();  ///< goals of --ik, as warnings of quality.json
};

/// Refuses a choice that names no pose, whatever the rig, before anything is read. Throws Error{usage}.
void check_frames(const FrameChoice& choice);

/// The poses, in order; notes what the clip moves nothing by, and where its zero pose was aligned. Throws
/// Error{usage} for a choice that names no pose, and as the readers do.
std::vector<Frame> read_frames(const Program& program, const FrameChoice& choice, const Rig& rig);

/// Notes the missed goals, for commands that give no verdict.
void note_missed(const Program& program, const std::vector<Frame>& frames);

}  // namespace ecorche::app
