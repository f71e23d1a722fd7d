// SPDX-License-Identifier: Apache-2.0
// Points as the kernels read them.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <span>

#include <ecorche/values/mesh.hpp>

namespace ecorche::runtime {

/// The same numbers, three per point; `points` must outlive it.
inline std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

/// One of them.
inline Eigen::Vector3d point(std::span<const float> points, std::size_t row) {
  return {static_cast<double>(points[3 * row]), static_cast<double>(points[3 * row + 1]),
          static_cast<double>(points[3 * row + 2])};
}

/// Six times the volume of a tet.
inline double det_of(const Tets& tets, std::span<const float> nodes, std::size_t t) {
  const auto node = [&](int c) {
    return point(nodes, static_cast<std::size_t>(tets(static_cast<Eigen::Index>(t), c)));
  };
  const Eigen::Vector3d a = node(0);
  return (node(1) - a).cross(node(2) - a).dot(node(3) - a);
}

}  // namespace ecorche::runtime
