// SPDX-License-Identifier: Apache-2.0
// What a model's correction and its safe ranges are, for `info` and `calibrate`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// A row a joint: how many samples, modes and nodes, the largest displacement and the largest turn sampled.
nlohmann::json corrections_json(const Model& model);
/// A row a place of each whole pose that is kept.
nlohmann::json pose_corrections_json(const Model& model);
/// Of those rows, a line a pose; empty without any.
std::string pose_corrections_text(const nlohmann::json& places);
/// Of the rows of add_whole_poses, likewise.
std::string settled_poses_text(const nlohmann::json& poses);

/// A row a joint, angle and way, in degrees, anatomical; null where nothing was met up to `looked_deg`.
nlohmann::json safe_ranges_json(const Model& model);

/// Both as tables; empty where the model has none.
std::string correction_text(const nlohmann::json& corrections, const nlohmann::json& ranges);

}  // namespace ecorche::app
