// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <ecorche/values/skeleton.hpp>

namespace ecorche::app {

/// A joint of a rig with its fit, as `info` and `rig` tell it; infinite limits are null.
nlohmann::json joint_json(const Rig& rig, std::size_t row);

}  // namespace ecorche::app
