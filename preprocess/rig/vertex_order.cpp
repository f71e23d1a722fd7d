// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/vertex_order.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace ecorche::rig {
namespace {

// Along no axis, and along none between two: few vertices of a grid of voxels share a place along it.
const Eigen::Vector3d& line() {
  static const Eigen::Vector3d unit = Eigen::Vector3d(std::sqrt(2.0) - 1, std::sqrt(3.0) - 1, 1).normalized();
  return unit;
}

}  // namespace

SurfaceMesh by_place(const SurfaceMesh& mesh, const std::string& segment) {
  const Eigen::Index count = mesh.V.rows();
  if (count == 0) return mesh;
  Points from = mesh.V.rowwise() - mesh.V.colwise().mean();
  if (segment.ends_with("_right")) {
    from.col(0) = -from.col(0);
  } else if (!segment.ends_with("_left")) {
    from.col(0) = from.col(0).cwiseAbs();
  }
  const Eigen::VectorXd place = from * line();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return place[a] < place[b]; });
  std::vector<std::int32_t> rank(order.size());
  SurfaceMesh out;
  out.V.resize(count, 3);
  for (std::size_t i = 0; i < order.size(); ++i) {
    out.V.row(static_cast<Eigen::Index>(i)) = mesh.V.row(order[i]);
    rank[static_cast<std::size_t>(order[i])] = static_cast<std::int32_t>(i);
  }
  out.F = mesh.F.unaryExpr([&](std::int32_t v) { return rank[static_cast<std::size_t>(v)]; });
  return out;
}

SurfacePoints as_left(const SurfacePoints& points) {
  SurfacePoints out = points;
  if (!points.right) return out;
  out.at.col(0) = -out.at.col(0);
  out.normal.col(0) = -out.normal.col(0);
  out.along.x() = -out.along.x();
  out.right = false;
  return out;
}

}  // namespace ecorche::rig
