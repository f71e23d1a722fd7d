// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/tissues_by_tet.hpp"

#include <tbb/parallel_for.h>

namespace ecorche::runtime {
namespace {

constexpr std::size_t kVerticesPerTask = 4096;

}  // namespace

std::string_view TissuesByTet::check() const {
  if (nodes.size() % 3 != 0) return "nodes is not three coordinates a node";
  if (tets.size() % 4 != 0) return "tets is not four nodes a tet";
  if (barycentric.size() != 4 * tet.size()) return "barycentric is not four numbers a vertex";
  if (posed.size() != 3 * tet.size()) return "posed is not three coordinates a vertex";
  return {};
}

void TissuesByTet::run() const {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, tet.size(), kVerticesPerTask), [this](const auto& vertices) {
        for (std::size_t v = vertices.begin(); v < vertices.end(); ++v) {
          const std::int32_t* corner = &tets[4 * static_cast<std::size_t>(tet[v])];
          const auto node = [&](int c) { return &nodes[3 * static_cast<std::size_t>(corner[c])]; };
          const float *x0 = node(0), *x1 = node(1), *x2 = node(2), *x3 = node(3);
          const float* b = &barycentric[4 * v];
          for (std::size_t c = 0; c < 3; ++c) {
            posed[3 * v + c] =
                x0[c] + (b[1] * (x1[c] - x0[c]) + b[2] * (x2[c] - x0[c]) + b[3] * (x3[c] - x0[c]));
          }
        }
      });
}

}  // namespace ecorche::runtime
