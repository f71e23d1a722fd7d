// SPDX-License-Identifier: Apache-2.0
// The slow, obvious twin of geometry/closest_point and geometry/face_tree.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include <ecorche/values/mesh.hpp>

namespace ecorche::test {

/// Distance of p from a triangle: its plane where the foot falls inside, else the nearest of its edges.
inline double triangle_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c) {
  const auto edge = [&](const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const double length = (v - u).squaredNorm();
    const double at = length > 0 ? std::clamp((p - u).dot(v - u) / length, 0.0, 1.0) : 0.0;
    return (p - (u + at * (v - u))).norm();
  };
  double least = std::min({edge(a, b), edge(b, c), edge(c, a)});
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  if (normal.norm() > 0) {
    const bool in = (b - a).cross(p - a).dot(normal) >= 0 && (c - b).cross(p - b).dot(normal) >= 0 &&
                    (a - c).cross(p - c).dot(normal) >= 0;
    if (in) least = std::min(least, std::abs((p - a).dot(normal)) / normal.norm());
  }
  return least;
}

/// Distance of p from the nearest of all triangles; infinity without any.
inline double surface_distance(const Eigen::Vector3d& p, const SurfaceMesh& surface) {
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
    least =
        std::min(least, triangle_distance(p, surface.V.row(surface.F(f, 0)), surface.V.row(surface.F(f, 1)),
                                          surface.V.row(surface.F(f, 2))));
  }
  return least;
}

}  // namespace ecorche::test
