// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/tet_kinds.hpp"

#include <ecorche/runtime/skin_caps.hpp>
#include "core/elastic/joint_gaps.hpp"
#include "runtime/quality/shared_joint.hpp"

namespace ecorche::runtime {
namespace {

bool lies_in_joint(const Model& model, const std::vector<std::int32_t>& held_by, std::size_t tet) {
  const auto corners = model.tets.row(static_cast<Eigen::Index>(tet));
  for (const std::int32_t x : corners) {
    for (const std::int32_t y : corners) {
      const std::int32_t a = held_by[static_cast<std::size_t>(x)], b = held_by[static_cast<std::size_t>(y)];
      if (a >= 0 && b >= 0 && a < b && share_joint(model.rig.skeleton, a, b)) return true;
    }
  }
  return false;
}

}  // namespace

std::vector<TetKind> tet_kinds(const Model& model) {
  std::vector<TetKind> out(model.tet_count(), TetKind::body);
  const std::vector<std::int32_t> held_by = elastic::held_by(model);
  const std::vector<std::uint8_t> between = elastic::joint_gaps(model, held_by);
  for (std::size_t t = 0; t < between.size(); ++t)
    if (between[t] != 0 && lies_in_joint(model, held_by, t)) out[t] = TetKind::gap;
  const std::vector<std::uint8_t> caps = cap_tets(model);
  for (std::size_t t = 0; t < caps.size(); ++t)
    if (caps[t] != 0) out[t] = TetKind::cap;
  return out;
}

}  // namespace ecorche::runtime
