// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <map>

#include "core/geometry/surface_edges.hpp"
#include "preprocess/repair/soup.hpp"

namespace ecorche::repair {

std::int64_t weld_open_edges(Soup& soup, double reach) {
  if (!(reach > 0)) return 0;
  std::vector<bool> open(soup.points.size(), false);
  const auto edges = geometry::sorted_edges(soup.F());
  geometry::each_edge(edges, [&](std::span<const geometry::HalfEdge> edge) {
    if (edge.size() != 1) return;
    open[static_cast<std::size_t>(edge[0].low)] = open[static_cast<std::size_t>(edge[0].high)] = true;
  });
  using Cell = std::array<std::int64_t, 3>;
  std::map<Cell, std::vector<std::int32_t>> kept;  // by cells of `reach`
  std::vector<std::int32_t> becomes(soup.points.size());
  std::int64_t welded = 0;
  for (std::size_t v = 0; v < soup.points.size(); ++v) {
    becomes[v] = static_cast<std::int32_t>(v);
    if (!open[v]) continue;
    const Eigen::Vector3d& p = soup.points[v];
    Cell cell;
    for (int k = 0; k < 3; ++k) cell[static_cast<std::size_t>(k)] = std::llround(p[k] / reach);
    double nearest = reach * reach;
    for (int n = 0; n < 27; ++n) {
      const auto at = kept.find({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
      if (at == kept.end()) continue;
      for (const std::int32_t other : at->second) {
        const double d = (soup.points[static_cast<std::size_t>(other)] - p).squaredNorm();
        if (d < nearest) nearest = d, becomes[v] = other;
      }
    }
    if (becomes[v] == static_cast<std::int32_t>(v)) {
      kept[cell].push_back(becomes[v]);
    } else {
      ++welded;
    }
  }
  for (auto& triangle : soup.triangles) {
    for (std::int32_t& corner : triangle) corner = becomes[static_cast<std::size_t>(corner)];
  }
  return welded;
}

}  // namespace ecorche::repair
