// SPDX-License-Identifier: Apache-2.0
// How stiff a model's flesh is, for `info` and `fem`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

/// Of each of the model's materials its tets that are no bone's.
std::vector<std::size_t> soft_tets_by_material(const Model& model);

/// A row a material: tissue (null: flesh of no tissue that says its own), young_kpa, tets. Empty where the
/// model has none. `tets`: as many as there are materials.
nlohmann::json materials_json(const Model& model, const std::vector<std::size_t>& tets);

/// On one line, without its end: `flesh 5 kPa (1234 tets), liver 20 kPa (56)`; empty for none.
std::string materials_line(const nlohmann::json& materials);

}  // namespace ecorche::app
