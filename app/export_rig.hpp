// SPDX-License-Identifier: Apache-2.0
// A model's skin and skeleton, and a motion on it, for other programs.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "app/motion_source.hpp"
#include "app/program.hpp"

namespace ecorche::app {

/// What of a model goes into a `.glb` or `.bvh`.
struct RigChoice {
  MotionChoice motion;               ///< no file: the scan alone
  std::vector<std::string> tissues;  ///< of a `.glb`: names, or `all`
  std::string bvh_unit = "cm";       ///< of a `.bvh`, which does not say it: mm, cm, m, in
};

/// Whether `path` is one that export_rig writes.
bool is_rig_file(const std::filesystem::path& path);

/// Writes the skeleton with the motion, within its limits: `.glb` also with the tissues, skinned by four
/// influences, `.bvh` in its unit. Returns what it did; a `.glb`'s says what cutting to four influences
/// costs, by linear blending over the motion's frames. Without a motion a `.bvh` has the scan as its only
/// frame. Throws Error{usage} for tissues that the model has not.
nlohmann::json export_rig(const Program& program, const Model& model, const RigChoice& choice,
                          const std::filesystem::path& path);

}  // namespace ecorche::app
