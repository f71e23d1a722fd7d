// SPDX-License-Identifier: Apache-2.0
// A pose by finite elements: what was asked for, the solution put into the posed body, and what is said of
// it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include <ecorche/values/context.hpp>
#include "app/measured_pose.hpp"

namespace ecorche::app {

struct FemSettings {
  std::string element = "p1";
  std::string material = "stable_neo_hookean";
  std::optional<double> poisson;  ///< else what its element is good for
  bool two_starts = true;
};

/// Poisson's ratio that an element is used at where none is given: linear tets lock beyond 0.45.
double poisson_of(const FemSettings& settings);

/// Throws Error{usage} for what does not go together.
void check_fem(const FemSettings& settings);

/// Solves from `posed` (which skinning posed) and puts the solution there where it converged; else the
/// body stays as skinned. Returns fem.json.
nlohmann::json pose_by_fem(const FemSettings& settings, MeasuredPose& posed, const Context& context);

/// Into quality.json: all of it under `fem`, its warnings first, and its verdict.
void add_fem(const nlohmann::json& fem, nlohmann::json& quality);

/// The line under a frame's own.
std::string fem_line(const nlohmann::json& fem);

}  // namespace ecorche::app
