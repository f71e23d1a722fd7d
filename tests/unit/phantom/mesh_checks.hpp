// SPDX-License-Identifier: Apache-2.0
// What every surface of the phantom must be.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::phantom {

inline Eigen::Vector3d corner(const SurfaceMesh& mesh, Eigen::Index f, int c) {
  return mesh.V.row(mesh.F(f, c)).transpose();
}

inline double volume(const SurfaceMesh& mesh) {
  double six = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f)
    six += corner(mesh, f, 0).dot(corner(mesh, f, 1).cross(corner(mesh, f, 2)));
  return six / 6;
}

inline double area(const SurfaceMesh& mesh) {
  double twice = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    twice += (corner(mesh, f, 1) - corner(mesh, f, 0)).cross(corner(mesh, f, 2) - corner(mesh, f, 0)).norm();
  }
  return twice / 2;
}

inline int components(const SurfaceMesh& mesh) {
  std::vector<int> root(static_cast<std::size_t>(mesh.V.rows()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[static_cast<std::size_t>(v)] != v) v = root[static_cast<std::size_t>(v)];
    return v;
  };
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 1; c < 3; ++c) root[static_cast<std::size_t>(find(mesh.F(f, c)))] = find(mesh.F(f, 0));
  }
  int count = 0;
  for (std::size_t v = 0; v < root.size(); ++v) count += root[v] == static_cast<int>(v) ? 1 : 0;
  return count;
}

/// Closed, consistently oriented, every edge in two triangles, every vertex in one fan, no vertex unused, no
/// degenerate triangle, outside out.
inline void expect_solid(const SurfaceMesh& mesh, const std::string& name) {
  SCOPED_TRACE(name);
  ASSERT_GT(mesh.F.rows(), 3);
  std::set<std::pair<int, int>> edges;
  std::vector<std::map<int, int>> fan(static_cast<std::size_t>(mesh.V.rows()));
  double smallest = 1e300;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const int a = mesh.F(f, c), b = mesh.F(f, (c + 1) % 3), d = mesh.F(f, (c + 2) % 3);
      ASSERT_TRUE(edges.emplace(a, b).second) << "edge " << a << " " << b << " twice in one direction";
      fan[static_cast<std::size_t>(a)][b] = d;
    }
    smallest = std::min(
        smallest,
        (corner(mesh, f, 1) - corner(mesh, f, 0)).cross(corner(mesh, f, 2) - corner(mesh, f, 0)).norm());
  }
  for (const auto& [a, b] : edges) ASSERT_TRUE(edges.count({b, a})) << "edge " << a << " " << b << " is open";
  for (std::size_t v = 0; v < fan.size(); ++v) {
    ASSERT_FALSE(fan[v].empty()) << "vertex " << v << " unused";
    const int first = fan[v].begin()->first;
    std::size_t steps = 0;
    int at = first;
    do {
      at = fan[v].at(at);
      ++steps;
    } while (at != first && steps <= fan[v].size());
    ASSERT_EQ(steps, fan[v].size()) << "vertex " << v << " joins two fans";
  }
  EXPECT_GT(smallest, 1e-6);
  EXPECT_GT(volume(mesh), 0);
  EXPECT_TRUE(mesh.V.allFinite());
}

/// Generalized winding number of `p`: 1 inside, 0 outside.
inline double winding(const SurfaceMesh& mesh, const Eigen::Vector3d& p) {
  double angle = 0;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Eigen::Vector3d a = corner(mesh, f, 0) - p, b = corner(mesh, f, 1) - p, c = corner(mesh, f, 2) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (2 * 3.14159265358979323846);
}

}  // namespace ecorche::phantom
