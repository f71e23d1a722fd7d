// SPDX-License-Identifier: Apache-2.0
// Surfaces as unordered triangles: what two readers must agree on, however they number vertices.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche {

/// Nine float32 a triangle, its least corner first (the turn is kept), sorted.
inline std::vector<std::array<float, 9>> soup(const SurfaceMesh& mesh) {
  std::vector<std::array<float, 9>> out;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    std::array<std::array<float, 3>, 3> corners{};
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k)
        corners[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)] =
            static_cast<float>(mesh.V(mesh.F(f, c), k)) + 0.0F;
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::array<float, 9>& row = out.emplace_back();
    for (std::size_t i = 0; i < 9; ++i) row[i] = corners[i / 3][i % 3];
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// The largest difference of a coordinate of two soups of equal size, or infinity.
inline double soup_distance(const SurfaceMesh& a, const SurfaceMesh& b) {
  const auto left = soup(a), right = soup(b);
  if (left.size() != right.size()) return std::numeric_limits<double>::infinity();
  double out = 0;
  for (std::size_t i = 0; i < left.size(); ++i) {
    for (std::size_t k = 0; k < 9; ++k)
      out = std::max(out, std::abs(static_cast<double>(left[i][k] - right[i][k])));
  }
  return out;
}

}  // namespace ecorche
