// SPDX-License-Identifier: Apache-2.0
#include "core/elastic/joint_gaps.hpp"

namespace ecorche::elastic {

std::vector<std::int32_t> held_by(const Model& model) {
  std::vector<std::int32_t> out(model.node_count(), -1);
  for (std::size_t t = 0; t < model.tet_count(); ++t) {
    if (model.tet_label[t] == TetMesh::soft) continue;
    for (const std::int32_t node : model.tets.row(static_cast<Eigen::Index>(t)))
      out[static_cast<std::size_t>(node)] = model.bone_segment[model.tet_label[t] - 1U];
  }
  return out;
}

std::vector<std::uint8_t> joint_gaps(const Model& model, const std::vector<std::int32_t>& held_by) {
  std::vector<std::uint8_t> out(model.tet_count(), 0);
  bool any = false;
  for (std::size_t t = 0; t < out.size(); ++t) {
    if (model.tet_label[t] != TetMesh::soft) continue;
    std::int32_t one = -1;
    for (const std::int32_t node : model.tets.row(static_cast<Eigen::Index>(t))) {
      const std::int32_t segment = held_by[static_cast<std::size_t>(node)];
      if (segment >= 0 && one >= 0 && segment != one) out[t] = 1;
      if (segment >= 0) one = segment;
    }
    any = any || out[t] != 0;
  }
  if (!any) out.clear();
  return out;
}

}  // namespace ecorche::elastic
