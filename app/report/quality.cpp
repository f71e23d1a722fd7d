// SPDX-License-Identifier: Apache-2.0
#include "app/report/quality.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/dihedral.hpp"

namespace ecorche::app::report {

double radius_ratio(const std::array<Eigen::Vector3d, 4>& corner) {
  const Eigen::Vector3d a = corner[1] - corner[0], b = corner[2] - corner[0], c = corner[3] - corner[0];
  const double det = std::abs(a.cross(b).dot(c));
  const double faces =  // twice their area
      a.cross(b).norm() + b.cross(c).norm() + c.cross(a).norm() + (b - a).cross(c - a).norm();
  const double inscribed = det / faces;
  const double circumscribed =
      (a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b)).norm() /
      (2 * det);
  return det > 0 ? 3 * inscribed / circumscribed : 0;
}

std::vector<Histogram> quality(const Model& model) {
  Histogram least("smallest dihedral angle of a tet", "deg", 0, 75, 75);
  Histogram greatest("largest dihedral angle of a tet", "deg", 60, 180, 60);
  Histogram ratio("radius ratio of a tet", "", 0, 1, 50);
  Histogram edge("longest edge of a tet", "mm", 0, 1, 50);
  std::vector<double> longest;
  longest.reserve(model.tet_count());
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
    std::array<Eigen::Vector3d, 4> corner;
    double most = 0;
    for (int c = 0; c < 4; ++c) {
      corner[static_cast<std::size_t>(c)] = model.nodes.row(model.tets(t, c)).transpose().cast<double>();
      for (int other = 0; other < c; ++other) {
        most = std::max(
            most, (corner[static_cast<std::size_t>(c)] - corner[static_cast<std::size_t>(other)]).norm());
      }
    }
    longest.push_back(most);
    const geometry::TetShape shape = geometry::tet_shape(corner);
    least.add(shape.least_deg());
    greatest.add(shape.greatest_deg());
    ratio.add(radius_ratio(corner));
  }
  edge.high = longest.empty() ? 1 : std::ceil(*std::max_element(longest.begin(), longest.end()));
  for (const double length : longest) edge.add(length);

  Histogram segments("segments that move a node by more than 0.001", "", 0.5, 16.5, 16);
  Histogram heaviest("largest weight of a node", "", 0, 1, 50);
  const Weights& weights = model.weights;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto first = weights.weight.begin() + static_cast<std::ptrdiff_t>(weights.offsets[n]);
    const auto last = weights.weight.begin() + static_cast<std::ptrdiff_t>(weights.offsets[n + 1]);
    segments.add(static_cast<double>(std::count_if(first, last, [](float w) { return w > 1e-3F; })));
    heaviest.add(first != last ? *std::max_element(first, last) : 0);
  }
  return {least, greatest, ratio, edge, segments, heaviest};
}

}  // namespace ecorche::app::report
