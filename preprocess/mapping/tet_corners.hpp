// SPDX-License-Identifier: Apache-2.0
// The corners of one tet, in double.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

inline std::array<Eigen::Vector3d, 4> corners_of(const PointsF& nodes, const Tets& tets, std::int64_t tet) {
  std::array<Eigen::Vector3d, 4> corner;
  for (int c = 0; c < 4; ++c)
    corner[static_cast<std::size_t>(c)] = nodes.row(tets(tet, c)).transpose().cast<double>();
  return corner;
}

}  // namespace ecorche::mapping
