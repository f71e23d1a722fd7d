// SPDX-License-Identifier: Apache-2.0
// Limbs that touch, for readers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// `[{limb, touches, own, other, area_cm2, at, text, mend}]`; `touches` is null for the trunk.
nlohmann::json contacts_json(const Model& model);

/// A line each, the advice last; empty where nothing touches.
std::string contacts_text(const nlohmann::json& contacts);

}  // namespace ecorche::app
