// SPDX-License-Identifier: Apache-2.0
// The tree of a volumetric skeleton and what its voxels hang on, as `ecorche thin` is told.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "app/cli_fwd.hpp"
#include "app/program.hpp"
#include "app/step_clock.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "preprocess/thin/mask.hpp"
#include "preprocess/thin/tree.hpp"

namespace ecorche::app {

struct HangSettings {
  bool tree = false;
  thin::TreeOptions options;
  std::filesystem::path skeleton, model, picks, reassign, snapped;
  bool snap = false;

  bool attaches() const { return !skeleton.empty() || !model.empty() || !picks.empty(); }
};

/// `--tree` and what belongs to it. `settings` must outlive the command line's parsing.
void add_hang_options(CLI::App& command, HangSettings& settings);

/// Refuses options that need others. Throws Error{usage}.
void check_hang_options(const HangSettings& settings);

/// Makes the tree where it is asked for or needed, and hangs every voxel on a segment of the skeleton file or
/// of the model's rig, or one made of picked points, where one is given; `mask` is then what was thinned.
/// Throws what the stages throw, Error{config} for joints outside the object.
void hang(const Program& program, const HangSettings& settings, const thin::Mask& mask,
          io::VolumetricSkeletonFile& file, StepClock& clock, nlohmann::json& report);

}  // namespace ecorche::app
