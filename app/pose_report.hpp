// SPDX-License-Identifier: Apache-2.0
// What `ecorche pose` says of a posed body.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/values/model.hpp>
#include "app/pose_warnings.hpp"

namespace ecorche::app {

/// at_mm, out and cm2 of each cap of the skin, LPS mm.
nlohmann::json caps_json(const Model& model);

/// `quality.json`, every key of which docs/reference/quality.md explains. `det_f`: of every tet, measured as
/// `quality`.
nlohmann::json quality_json(const Model& model, const runtime::PosedBody& body,
                            const runtime::PoseQuality& quality, std::span<const float> det_f,
                            const HowPosed& how);

/// A frame's report: a line of its folder, quality and files, one for each of the worst warnings, one for
/// each clamped joint.
std::string line_of(const nlohmann::json& frame);

}  // namespace ecorche::app
