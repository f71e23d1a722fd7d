// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/tet_kinds.hpp"

#include <ecorche/runtime/skin_caps.hpp>
#include "core/elastic/joint_gaps.hpp"

namespace ecorche::runtime {

std::vector<TetKind> tet_kinds(const Model& model) {
  std::vector<TetKind> out(model.tet_count(), TetKind::body);
  const auto mark = [&](const std::vector<std::uint8_t>& these, TetKind kind) {
    for (std::size_t t = 0; t < these.size(); ++t)
      if (these[t] != 0) out[t] = kind;
  };
  mark(elastic::joint_gaps(model, elastic::held_by(model)), TetKind::gap);
  mark(cap_tets(model), TetKind::cap);
  return out;
}

}  // namespace ecorche::runtime
