// SPDX-License-Identifier: Apache-2.0
// The slow, obvious twin of the mapping: looks at every tet and at every boundary face.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::test {

inline Eigen::Vector3d node(const PointsF& nodes, std::int32_t row) {
  return nodes.row(row).transpose().cast<double>();
}

/// Smallest of the four barycentric coordinates of p, each as a ratio of signed volumes.
inline double least_coordinate(const PointsF& nodes, const Tets& tets, std::int32_t tet,
                               const Eigen::Vector3d& p) {
  std::array<Eigen::Vector3d, 4> x;
  for (int c = 0; c < 4; ++c) x[static_cast<std::size_t>(c)] = node(nodes, tets(tet, c));
  const auto volume = [](const auto& y) {
    return tet_det(y[0].transpose(), y[1].transpose(), y[2].transpose(), y[3].transpose());
  };
  const double whole = volume(x);
  double least = 1;
  for (std::size_t c = 0; c < 4; ++c) {
    auto part = x;
    part[c] = p;
    least = std::min(least, volume(part) / whole);
  }
  return least;
}

/// The first tet of all that holds p, or -1.
inline std::int32_t first_holder(const PointsF& nodes, const Tets& tets, const Eigen::Vector3d& p) {
  const Eigen::RowVector3f q = p.transpose().cast<float>();
  for (std::int32_t t = 0; t < tets.rows(); ++t) {
    bool near = true;  // bounding boxes first, a hundredth of a millimetre wide of the mark
    for (int axis = 0; axis < 3 && near; ++axis) {
      const float a = nodes(tets(t, 0), axis), b = nodes(tets(t, 1), axis), c = nodes(tets(t, 2), axis),
                  d = nodes(tets(t, 3), axis);
      near = q[axis] > std::min(std::min(a, b), std::min(c, d)) - 0.01F &&
             q[axis] < std::max(std::max(a, b), std::max(c, d)) + 0.01F;
    }
    if (near && least_coordinate(nodes, tets, t, p) >= -1e-9) return t;
  }
  return -1;
}

/// Faces that one tet only has, with that tet.
inline std::map<std::array<std::int32_t, 3>, std::int32_t> outer_faces(const Tets& tets) {
  std::map<std::array<std::int32_t, 3>, std::vector<std::int32_t>> owners;
  for (std::int32_t t = 0; t < tets.rows(); ++t) {
    for (int skip = 0; skip < 4; ++skip) {
      std::array<std::int32_t, 3> face;
      for (int c = 0, i = 0; c < 4; ++c) {
        if (c != skip) face[static_cast<std::size_t>(i++)] = tets(t, c);
      }
      std::sort(face.begin(), face.end());
      owners[face].push_back(t);
    }
  }
  std::map<std::array<std::int32_t, 3>, std::int32_t> outer;
  for (const auto& [face, held] : owners) {
    if (held.size() == 1) outer[face] = held[0];
  }
  return outer;
}

/// The run time's way from rest to rest, in float32.
inline Eigen::RowVector3f rebuilt(const PointsF& nodes, const Tets& tets, std::int32_t tet,
                                  const Eigen::RowVector4f& bary) {
  const Eigen::RowVector3f x0 = nodes.row(tets(tet, 0));
  return x0 + bary[1] * (nodes.row(tets(tet, 1)) - x0) + bary[2] * (nodes.row(tets(tet, 2)) - x0) +
         bary[3] * (nodes.row(tets(tet, 3)) - x0);
}

}  // namespace ecorche::test
