// SPDX-License-Identifier: Apache-2.0
#include "app/materials_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace ecorche::app {

using Json = nlohmann::json;

std::vector<std::size_t> soft_tets_by_material(const Model& model) {
  std::vector<std::size_t> out(model.materials.tissue.size(), 0);
  for (std::size_t t = 0; t < model.materials.of_tet.size(); ++t)
    if (model.tet_label[t] == TetMesh::soft) ++out[model.materials.of_tet[t]];
  return out;
}

Json materials_json(const Model& model, const std::vector<std::size_t>& tets) {
  Json out = Json::array();
  for (std::size_t m = 0; m < model.materials.tissue.size(); ++m) {
    const std::int32_t row = model.materials.tissue[m];
    out.push_back({{"tissue", row < 0 ? Json() : Json(model.tissues[static_cast<std::size_t>(row)].name)},
                   {"young_kpa", model.materials.young_kpa[m]},
                   {"tets", tets[m]}});
  }
  return out;
}

std::string materials_line(const Json& materials) {
  std::string out;
  for (const Json& row : materials)
    out += fmt::format("{}{} {:g} kPa ({}{})", out.empty() ? "" : ", ",
                       row["tissue"].is_null() ? "flesh" : row["tissue"].get<std::string>(),
                       row["young_kpa"].get<double>(), row["tets"].get<std::size_t>(),
                       out.empty() ? " tets" : "");
  return out;
}

}  // namespace ecorche::app
