// SPDX-License-Identifier: Apache-2.0
#include "app/model_report.hpp"

#include <nlohmann/json.hpp>

#include <ecorche/values/joint_rule.hpp>

namespace ecorche::app {

nlohmann::json model_report(bool ok, const Model* model, const Certificate& c, std::size_t checked,
                            std::size_t bad) {
  const auto known = [&](auto value) { return model != nullptr ? nlohmann::json(value) : nlohmann::json(); };
  const auto count = [&](auto of) {
    return model != nullptr ? nlohmann::json(of(*model)) : nlohmann::json();
  };
  nlohmann::json rig = nlohmann::json::array();
  for (const JointFit& fit : model != nullptr ? model->rig.fits : std::vector<JointFit>{}) {
    rig.push_back({{"joint", fit.joint},
                   {"rule", center_rule_name(fit.rule)},
                   {"residual_mm", fit.residual_mm},
                   {"inlier_share", fit.inlier_share},
                   {"points", fit.points},
                   {"confidence", fit.confidence}});
  }
  return {
      {"ok", ok},
      {"rig", rig},
      {"nodes", count([](const Model& m) { return m.node_count(); })},
      {"tets", count([](const Model& m) { return m.tet_count(); })},
      {"segments", count([](const Model& m) { return m.segment_count(); })},
      {"weights",
       {{"min", known(c.min_weight)},
        {"max", known(c.max_weight)},
        {"row_sum_error", known(c.row_sum_error)},
        {"repaired_rows", known(c.repaired_rows)}}},
      {"mesh",
       {{"min_dihedral_deg", known(c.min_dihedral_deg)},
        {"max_dihedral_deg", known(c.max_dihedral_deg)},
        {"inverted", known(c.inverted_tets)},
        {"positive_offdiagonal_share", known(c.positive_offdiagonal_share)}}},
      {"tissues",
       {{"count", count([](const Model& m) { return m.tissues.size(); })},
        {"vertices", known(c.tissue_vertices)},
        {"outside", known(c.outside_vertices)},
        {"max_outside_mm", known(c.max_outside_mm)}}},
      {"bones", {{"rigidity", known(c.bone_rigidity_mm)}}},
      {"digests", {{"checked", checked}, {"bad", bad}}},
  };
}

}  // namespace ecorche::app
