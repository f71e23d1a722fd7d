// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/tissue_nodes.hpp"

namespace ecorche::runtime {

TissueNodes NodesOfTissues::of(const Tissue& tissue) {
  TissueNodes out;
  out.corners.reserve(tissue.tet.size());
  for (const std::int32_t tet : tissue.tet) {
    std::array<std::uint32_t, 4>& corners = out.corners.emplace_back();
    for (int c = 0; c < 4; ++c) {
      const auto node = static_cast<std::uint32_t>(model_.tets(tet, c));
      std::uint32_t& place = place_[node];
      if (place == none) {
        place = static_cast<std::uint32_t>(out.nodes.size());
        out.nodes.push_back(node);
      }
      corners[static_cast<std::size_t>(c)] = place;
    }
  }
  for (const std::uint32_t node : out.nodes) place_[node] = none;
  return out;
}

}  // namespace ecorche::runtime
