// SPDX-License-Identifier: Apache-2.0
// Closed surfaces whose insides are known by formula.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include <ecorche/values/case.hpp>

namespace ecorche::shapes {

/// An axis-parallel box.
inline SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  SurfaceMesh mesh;
  mesh.V.resize(8, 3);
  for (int n = 0; n < 8; ++n)
    mesh.V.row(n) << ((n & 1) != 0 ? high : low)[0], ((n & 2) != 0 ? high : low)[1],
        ((n & 4) != 0 ? high : low)[2];
  mesh.F.resize(12, 3);
  mesh.F << 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7,
      4, 7, 6;
  return mesh;
}

/// An ellipsoid: an octahedron whose edges are cut into n, on the sphere, scaled. 4 n^2 + 2 vertices.
inline SurfaceMesh ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, int n) {
  std::map<std::array<int, 3>, int> number;
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> faces;
  const auto spread = [&](int t) { return std::sin(t * std::numbers::pi / (2 * n)); };
  const auto vertex = [&](int x, int y, int z) {
    const auto [entry, fresh] = number.try_emplace({x, y, z}, static_cast<int>(points.size()));
    if (fresh) {
      const Eigen::Vector3d unit = Eigen::Vector3d(spread(x), spread(y), spread(z)).normalized();
      points.push_back(centre + radii.cwiseProduct(unit));
    }
    return entry->second;
  };
  for (int octant = 0; octant < 8; ++octant) {
    const int sx = (octant & 1) != 0 ? -1 : 1, sy = (octant & 2) != 0 ? -1 : 1,
              sz = (octant & 4) != 0 ? -1 : 1;
    const auto at = [&](int i, int j) { return vertex(sx * i, sy * j, sz * (n - i - j)); };
    const auto face = [&](int a, int b, int c) {
      if (sx * sy * sz > 0) {
        faces.push_back({a, b, c});
      } else {
        faces.push_back({a, c, b});
      }
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        face(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) face(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  SurfaceMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v)
    mesh.V.row(static_cast<Eigen::Index>(v)) = points[v].transpose();
  mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    mesh.F.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return mesh;
}

/// The same surface turned inside out.
inline SurfaceMesh inside_out(SurfaceMesh mesh) {
  mesh.F.col(1).swap(mesh.F.col(2));
  return mesh;
}

/// Both surfaces as one.
inline SurfaceMesh together(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh mesh;
  mesh.V.resize(a.V.rows() + b.V.rows(), 3);
  mesh.V << a.V, b.V;
  mesh.F.resize(a.F.rows() + b.F.rows(), 3);
  mesh.F << a.F, (b.F.array() + static_cast<std::int32_t>(a.V.rows())).matrix();
  return mesh;
}

inline Case body(SurfaceMesh skin, std::vector<SurfaceMesh> bones = {}) {
  Case out;
  out.name = "test";
  out.skin = std::move(skin);
  for (std::size_t b = 0; b < bones.size(); ++b)
    out.bones.push_back({"bone_" + std::to_string(b), "segment_" + std::to_string(b), std::move(bones[b])});
  return out;
}

}  // namespace ecorche::shapes
