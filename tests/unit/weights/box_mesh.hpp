// SPDX-License-Identifier: Apache-2.0
// A box of cubes, six tets each (Kuhn's split: no positive off-diagonals), for the tests of weights and
// centres.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <random>

#include <ecorche/values/mesh.hpp>

namespace ecorche::test {

/// n[0] x n[1] x n[2] cubes of the given edge, from the origin. `label` is asked at the middle of each cube
/// (may be empty: all soft). Cubes for which it returns `kHole` are left out; their corners stay only where a
/// neighbour is.
inline constexpr std::uint16_t kHole = 65535;
inline TetMesh box_mesh(const std::array<int, 3>& n, double edge,
                        const std::function<std::uint16_t(const Eigen::Vector3d&)>& label = {}) {
  const auto node = [&](int i, int j, int k) { return i + (n[0] + 1) * (j + (n[1] + 1) * k); };
  Points corners((n[0] + 1) * (n[1] + 1) * (n[2] + 1), 3);
  for (int k = 0; k <= n[2]; ++k) {
    for (int j = 0; j <= n[1]; ++j) {
      for (int i = 0; i <= n[0]; ++i) corners.row(node(i, j, k)) = edge * Eigen::RowVector3d(i, j, k);
    }
  }
  constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  std::vector<std::int32_t> tets;
  TetMesh mesh;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        const std::uint16_t l =
            label ? label(edge * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5)) : TetMesh::soft;
        if (l == kHole) continue;
        for (int p = 0; p < 6; ++p) {
          std::array<int, 3> at{i, j, k};
          std::array<std::int32_t, 4> tet{node(i, j, k)};
          for (std::size_t s = 0; s < 3; ++s) {
            ++at[static_cast<std::size_t>(kPaths[p][s])];
            tet[s + 1] = node(at[0], at[1], at[2]);
          }
          if (p >= 3) std::swap(tet[1], tet[2]);  // odd permutations turn the tet inside out
          tets.insert(tets.end(), tet.begin(), tet.end());
          mesh.label.push_back(l);
        }
      }
    }
  }
  std::vector<std::int32_t> row(static_cast<std::size_t>(corners.rows()), -1);
  std::int32_t used = 0;
  for (const std::int32_t c : tets) row[static_cast<std::size_t>(c)] = 0;
  for (auto& r : row) {
    if (r == 0) r = used++;
  }
  mesh.V.resize(used, 3);
  for (std::size_t c = 0; c < row.size(); ++c) {
    if (row[c] >= 0) mesh.V.row(row[c]) = corners.row(static_cast<Eigen::Index>(c));
  }
  mesh.T.resize(static_cast<Eigen::Index>(tets.size() / 4), 4);
  for (std::size_t i = 0; i < tets.size(); ++i) mesh.T.data()[i] = row[static_cast<std::size_t>(tets[i])];
  return mesh;
}

/// A box whose inner nodes are shaken: tets of every shape.
inline TetMesh shaken_box(int n, double by) {
  TetMesh mesh = box_mesh({n, n, n}, 10);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shift(-by, by);
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i) {
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double x = mesh.V(i, c);
      if (x > 0 && x < 10 * n) mesh.V(i, c) += shift(random);
    }
  }
  return mesh;
}

}  // namespace ecorche::test
