// SPDX-License-Identifier: Apache-2.0
// Small tet meshes that are not convex.
#pragma once

#include <map>
#include <random>

#include <ecorche/values/mesh.hpp>

namespace ecorche::test {

struct FloatTets {
  PointsF nodes;
  Tets tets;
};

/// A block of cubes of edge 4 mm from `corner`, six tets each (Kuhn), of which `keep(i, j, k)` says which
/// exist; nodes are jittered by up to `jitter` mm, small enough that no tet turns over.
template <class Keep>
FloatTets block(int size, const Eigen::Vector3d& corner, double jitter, Keep&& keep) {
  constexpr double kEdge = 4;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> shift(-jitter, jitter);
  std::map<std::array<int, 3>, std::int32_t> row;
  std::vector<Eigen::Vector3d> points;
  const auto at = [&](const std::array<int, 3>& ijk) {
    const auto [found, added] = row.try_emplace(ijk, static_cast<std::int32_t>(points.size()));
    if (added) {
      points.push_back(corner + kEdge * Eigen::Vector3d(ijk[0], ijk[1], ijk[2]) +
                       Eigen::Vector3d(shift(random), shift(random), shift(random)));
    }
    return found->second;
  };
  constexpr int kOrders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  std::vector<Eigen::RowVector4i> tets;
  for (int k = 0; k < size; ++k) {
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) {
        if (!keep(i, j, k)) continue;
        for (int o = 0; o < 6; ++o) {
          std::array<int, 3> walk{i, j, k};
          Eigen::RowVector4i tet;
          tet[0] = at(walk);
          for (int step = 0; step < 3; ++step) {
            ++walk[static_cast<std::size_t>(kOrders[o][step])];
            tet[step + 1] = at(walk);
          }
          if (o >= 3) std::swap(tet[1], tet[2]);  // odd orders run the other way round
          tets.push_back(tet);
        }
      }
    }
  }
  FloatTets out;
  out.nodes.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t n = 0; n < points.size(); ++n) {
    out.nodes.row(static_cast<Eigen::Index>(n)) = points[n].transpose().cast<float>();
  }
  out.tets.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t) out.tets.row(static_cast<Eigen::Index>(t)) = tets[t];
  return out;
}

/// A letter C, 6 x 6 x 6 cubes with a slot: points in the slot are outside and near two arms.
inline FloatTets letter_c(const Eigen::Vector3d& corner = {0, 0, 0}, double jitter = 0.6) {
  return block(6, corner, jitter, [](int i, int j, int) { return !(i >= 2 && (j == 2 || j == 3)); });
}

}  // namespace ecorche::test
