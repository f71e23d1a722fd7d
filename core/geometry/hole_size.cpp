// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/hole_size.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::geometry {

double filling_edge(const Points& V, const BoundaryLoop& loop) {
  const std::size_t n = loop.vertices.size();
  if (!loop.closed || n < 3) return 0;
  const auto at = [&](std::size_t i) -> Eigen::Vector3d { return V.row(loop.vertices[i % n]).transpose(); };
  double least = std::numeric_limits<double>::infinity();
  const std::size_t step = std::max<std::size_t>(1, n / 64);
  for (std::size_t hub = 0; hub < n; hub += step) {
    const Eigen::Vector3d from = at(hub);
    double area = 0;
    for (std::size_t i = 1; i + 1 < n; ++i)
      area += 0.5 * (at(hub + i) - from).cross(at(hub + i + 1) - from).norm();
    least = std::min(least, area);
  }
  return std::sqrt(least);
}

LargestHole largest_hole(const SurfaceMesh& surface) {
  LargestHole out;
  out.closed = true;
  const std::vector<HalfEdge> edges = sorted_edges(surface.F);
  for (const BoundaryLoop& loop : boundary_loops(edges)) {
    ++out.holes;
    out.closed = out.closed && loop.closed;
    const double edge = filling_edge(surface.V, loop);
    if (edge <= out.filling_edge) continue;
    out.filling_edge = edge;
    out.edges = loop.vertices.size();
    out.middle.setZero();
    for (const std::int32_t v : loop.vertices)
      out.middle += surface.V.row(v).transpose() / static_cast<double>(loop.vertices.size());
  }
  return out;
}

}  // namespace ecorche::geometry
