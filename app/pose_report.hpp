// SPDX-License-Identifier: Apache-2.0
// What `ecorche pose` says of a posed body.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/values/model.hpp"
#include "runtime/quality/pose_quality.hpp"
#include "runtime/skin/body_poser.hpp"

namespace ecorche::app {

/// `quality.json`.
nlohmann::json quality_json(const Model& model, const runtime::PosedBody& body,
                            const runtime::PoseQuality& quality);

/// One line of a frame's report: its folder, quality and files.
std::string line_of(const nlohmann::json& frame);

}  // namespace ecorche::app
