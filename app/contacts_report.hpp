// SPDX-License-Identifier: Apache-2.0
// Limbs that touch, for readers.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// `[{limb, touches, own, other, area_cm2, at, text, mend}]`; `touches` is null for the trunk.
nlohmann::json contacts_json(const Model& model);

/// A line each, the advice last; empty where nothing touches.
std::string contacts_text(const nlohmann::json& contacts);

/// Where limbs were cut free: `[{limb, of, own, other, area_cm2, confidence, at, text}]`; `of` is null for
/// the trunk.
nlohmann::json cut_contacts_json(const Model& model);

/// A line each; empty where none was cut.
std::string cut_contacts_text(const nlohmann::json& contacts);

}  // namespace ecorche::app
