// SPDX-License-Identifier: Apache-2.0
// What moves flesh after skinning: --unfold, --settle, and finite elements.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>

#include "app/cli_fwd.hpp"
#include "app/measured_pose.hpp"
#include "app/pose_plan.hpp"

namespace ecorche::app {

/// --unfold and --settle.
void add_relaxing(CLI::App& command, PoseSettings& settings);

/// Refuses what does not go together, whatever the model. Throws Error{usage}.
void check_relaxing(const PoseSettings& settings);

/// As the settings ask, one frame after another.
class PoseRelaxer {
 public:
  PoseRelaxer(const PoseSettings& settings, const Model& model) : settings_(settings), model_(model) {}

  /// Moves the body. What was done, as `unfolded`, `settled` and `fem` of quality.json.
  nlohmann::json run(MeasuredPose& posed, const Context& context);

 private:
  const PoseSettings& settings_;
  const Model& model_;
  std::unique_ptr<const runtime::FleshSettler> settler_;  // of the first frame that needs it
};

/// What `run` did, into quality.json.
void add_relaxed(const nlohmann::json& done, nlohmann::json& quality);

/// A line under the frame's own, where quality.json holds `settled`; else empty.
std::string settled_line(const nlohmann::json& quality);

}  // namespace ecorche::app
