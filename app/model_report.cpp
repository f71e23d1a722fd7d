// SPDX-License-Identifier: Apache-2.0
#include "app/model_report.hpp"

#include <algorithm>

#include "preprocess/pipeline.hpp"

namespace ecorche::app {

nlohmann::json model_report(const Model& model, const std::vector<model_file::DigestCheck>& digests) {
  const Certificate& c = model.certificate;
  const auto bad = std::count_if(digests.begin(), digests.end(), [](const auto& d) { return !d.good; });
  return {
      {"ok", bad == 0 && preprocess::broken_bounds(c).empty()},
      {"nodes", model.node_count()},
      {"tets", model.tet_count()},
      {"segments", model.segment_count()},
      {"weights",
       {{"min", c.min_weight},
        {"max", c.max_weight},
        {"row_sum_error", c.row_sum_error},
        {"repaired_rows", c.repaired_rows},
        {"repaired_largest_change", c.repaired_largest_change},
        {"solved_min", c.solved_min_weight},
        {"solved_max", c.solved_max_weight},
        {"solved_row_sum_error", c.solved_row_sum_error},
        {"solver_residual", c.solver_residual}}},
      {"mesh",
       {{"min_dihedral_deg", c.min_dihedral_deg},
        {"max_dihedral_deg", c.max_dihedral_deg},
        {"inverted", c.inverted_tets},
        {"degenerate", c.degenerate_tets},
        {"positive_offdiagonal_share", c.positive_offdiagonal_share}}},
      {"tissues",
       {{"count", model.tissues.size()},
        {"vertices", c.tissue_vertices},
        {"outside", c.outside_vertices},
        {"max_outside_mm", c.max_outside_mm}}},
      {"bones", {{"rigidity", c.bone_rigidity_mm}}},
      {"digests", {{"checked", digests.size()}, {"bad", bad}}},
  };
}

}  // namespace ecorche::app
