// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/surface_points.hpp"

#include <Eigen/Geometry>

namespace ecorche::rig {

SurfacePoints surface_points(const SurfaceMesh& mesh, const std::vector<Eigen::Index>& rows) {
  Points normal = Points::Zero(mesh.V.rows(), 3);
  std::vector<double> area(static_cast<std::size_t>(mesh.V.rows()), 0);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Eigen::Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)),
                          c = mesh.V.row(mesh.F(f, 2));
    const Eigen::RowVector3d twice = (b - a).cross(c - a).transpose();
    for (int i = 0; i < 3; ++i) {
      normal.row(mesh.F(f, i)) += twice;
      area[static_cast<std::size_t>(mesh.F(f, i))] += twice.norm() / 6;
    }
  }
  SurfacePoints out;
  out.at.resize(static_cast<Eigen::Index>(rows.size()), 3);
  out.normal.resize(out.at.rows(), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto to = static_cast<Eigen::Index>(i);
    out.at.row(to) = mesh.V.row(rows[i]);
    out.normal.row(to) = normal.row(rows[i]).normalized();
    out.area.push_back(area[static_cast<std::size_t>(rows[i])]);
  }
  return out;
}

}  // namespace ecorche::rig
