// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/carry_tissues.hpp"

#include <algorithm>

namespace ecorche::runtime {

void carry_tissues(const Model& model, const std::vector<std::uint8_t>& moved, PosedBody& body) {
  for (std::size_t i = 0; i < model.tissues.size(); ++i) {
    const Tissue& tissue = model.tissues[i];
    if (tissue.segment != Tissue::by_tets || body.tissues[i].empty()) continue;
    for (std::size_t v = 0; v < tissue.tet.size(); ++v) {
      const auto tet = model.tets.row(tissue.tet[v]);
      if (!std::any_of(tet.begin(), tet.end(),
                       [&](std::int32_t n) { return moved[static_cast<std::size_t>(n)] != 0; }))
        continue;
      for (std::size_t c = 0; c < 3; ++c) {
        double p = 0;
        for (int k = 0; k < 4; ++k)
          p += static_cast<double>(tissue.barycentric(static_cast<Eigen::Index>(v), k)) *
               static_cast<double>(body.nodes[3 * static_cast<std::size_t>(tet[k]) + c]);
        body.tissues[i][3 * v + c] = static_cast<float>(p);
      }
    }
  }
}

}  // namespace ecorche::runtime
