// SPDX-License-Identifier: Apache-2.0
// Closest points on triangles and tets.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

namespace ecorche::geometry {

/// The point of triangle (a, b, c) that is closest to p, by Voronoi regions (Ericson, Real-Time Collision
/// Detection, 5.1.5). A triangle without area answers one of its edges or corners.
inline Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                           const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return a + ab * (d1 / (d1 - d3));
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6 && (d4 - d3) + (d5 - d6) > 0) {
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  }
  const double sum = va + vb + vc;
  return a + ab * (vb / sum) + ac * (vc / sum);
}

/// Barycentric coordinates of p in the tet of these corners; they sum to 1 and are signed outside it.
inline Eigen::Vector4d barycentric(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 4>& corner) {
  const Eigen::Vector3d u = corner[1] - corner[0], v = corner[2] - corner[0], w = corner[3] - corner[0];
  const Eigen::Vector3d q = p - corner[0], vw = v.cross(w);
  const double det = u.dot(vw);
  const double b1 = q.dot(vw) / det, b2 = q.dot(w.cross(u)) / det, b3 = q.dot(u.cross(v)) / det;
  return {1 - b1 - b2 - b3, b1, b2, b3};
}

/// Distance, mm, of p from the tet; 0 inside.
inline double distance_to_tet(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 4>& corner) {
  if (barycentric(p, corner).minCoeff() >= 0) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t skip = 0; skip < 4; ++skip) {
    const Eigen::Vector3d q =
        closest_on_triangle(p, corner[(skip + 1) % 4], corner[(skip + 2) % 4], corner[(skip + 3) % 4]);
    least = std::min(least, (p - q).squaredNorm());
  }
  return std::sqrt(least);
}

}  // namespace ecorche::geometry
