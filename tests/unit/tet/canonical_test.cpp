// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "preprocess/tet/mesher.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/tet/tet_measures.hpp"

namespace ecorche::tet {
namespace {

/// Cubes of a grid, six tets each, with doubles that float32 rounds.
TetMesh grid(int n) {
  TetMesh mesh;
  mesh.V.resize((n + 1) * (n + 1) * (n + 1), 3);
  const auto at = [n](int i, int j, int k) { return (k * (n + 1) + j) * (n + 1) + i; };
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        mesh.V.row(at(i, j, k)) << 0.1 + i / 3.0, -7.7 + j / 3.0, 1000.0 / 7 + k / 3.0;
  mesh.T.resize(6 * n * n * n, 4);
  Eigen::Index t = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        for (const std::array<int, 3> order :
             {std::array{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}) {
          std::array<int, 3> step{i, j, k};
          mesh.T(t, 0) = at(step[0], step[1], step[2]);
          for (int c = 0; c < 3; ++c) {
            ++step[static_cast<std::size_t>(order[static_cast<std::size_t>(c)])];
            mesh.T(t, c + 1) = at(step[0], step[1], step[2]);
          }
          if (measures::volume(mesh, t) < 0) std::swap(mesh.T(t, 2), mesh.T(t, 3));
          mesh.label.push_back(static_cast<std::uint16_t>(t % 5));
          ++t;
        }
  return mesh;
}

/// The same mesh with nodes and tets in another order, the corners of each tet turned, unused and doubled
/// nodes added.
TetMesh shuffled(const TetMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  const auto n = static_cast<std::size_t>(mesh.V.rows());
  std::vector<std::int32_t> place(n);
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  TetMesh out;
  out.V.resize(mesh.V.rows() + 2, 3);
  for (std::size_t v = 0; v < n; ++v) out.V.row(place[v]) = mesh.V.row(static_cast<Eigen::Index>(v));
  out.V.row(mesh.V.rows()) << 5, 5, 5;                                      // unused
  out.V.row(mesh.V.rows() + 1) = mesh.V.row(mesh.T(0, 0)).array() + 1e-12;  // the same place in float32
  std::vector<Eigen::Index> order(static_cast<std::size_t>(mesh.T.rows()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::shuffle(order.begin(), order.end(), random);
  out.T.resize(mesh.T.rows(), 4);
  for (std::size_t t = 0; t < order.size(); ++t) {
    static constexpr int kEven[3][4] = {{0, 1, 2, 3}, {1, 0, 3, 2}, {2, 3, 0, 1}};
    const int* turn = kEven[random() % 3];
    for (int c = 0; c < 4; ++c) {
      const std::int32_t node = mesh.T(order[t], turn[c]);
      out.T(static_cast<Eigen::Index>(t), c) = order[t] == 0 && node == mesh.T(0, 0)
                                                   ? static_cast<std::int32_t>(mesh.V.rows() + 1)
                                                   : place[static_cast<std::size_t>(node)];
    }
    out.label.push_back(mesh.label[static_cast<std::size_t>(order[t])]);
  }
  return out;
}

TEST(Canonical, DependsOnGeometryAlone) {
  const TetMesh input = grid(5);
  TetMesh once = input;
  canonicalize(once);
  for (const unsigned seed : {1U, 2U, 3U}) {
    TetMesh other = shuffled(input, seed);
    canonicalize(other);
    EXPECT_TRUE(measures::same(once, other)) << seed;
  }
  TetMesh twice = once;
  canonicalize(twice);
  EXPECT_TRUE(measures::same(once, twice));
}

TEST(Canonical, KeepsTheMesh) {
  const TetMesh input = grid(4);
  TetMesh mesh = shuffled(input, 4);
  canonicalize(mesh);
  EXPECT_EQ(mesh.V.rows(), input.V.rows());
  EXPECT_EQ(mesh.T.rows(), input.T.rows());
  EXPECT_TRUE(mesh.V == mesh.V.cast<float>().cast<double>().eval());
  EXPECT_GT(measures::smallest_volume(mesh), 0);
  const auto before = measures::volumes(input), after = measures::volumes(mesh);
  ASSERT_EQ(before.size(), after.size());
  for (const auto& [label, volume] : before) EXPECT_NEAR(after.at(label), volume, 1e-4 * volume);
}

TEST(Canonical, NeighboursInSpaceAreNeighboursInMemory) {
  const TetMesh input = shuffled(grid(8), 5);
  TetMesh mesh = input;
  canonicalize(mesh);
  const auto span = [](const TetMesh& m) {
    double sum = 0;
    for (Eigen::Index t = 0; t < m.T.rows(); ++t) sum += m.T.row(t).maxCoeff() - m.T.row(t).minCoeff();
    return sum / static_cast<double>(m.T.rows());
  };
  EXPECT_LT(span(mesh), 0.4 * span(input));
}

TEST(Canonical, FlatTetIsRefusedWithItsPlace) {
  TetMesh mesh;
  mesh.V.resize(4, 3);
  mesh.V << 1000, 0, 0, 1001, 0, 0, 1000, 1, 0, 1000, 0.3, 1e-60;  // the height is lost in single precision
  mesh.T.resize(1, 4);
  mesh.T << 0, 1, 2, 3;
  mesh.label = {0};
  try {
    canonicalize(mesh);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::internal);
    EXPECT_NE(std::string(e.what()).find("is flat or inverted in single precision"), std::string::npos)
        << e.what();
  }
}

TEST(Canonical, BadIndicesAreRefused) {
  TetMesh mesh = grid(1);
  mesh.T(0, 0) = 99;
  expect_error(ErrorKind::internal, "tets: a tet names a node that is not there (this is a bug",
               [&] { canonicalize(mesh); });
  mesh = grid(1);
  mesh.label.pop_back();
  expect_error(ErrorKind::internal, "tets: labels do not match tets (this is a bug",
               [&] { canonicalize(mesh); });
}

}  // namespace
}  // namespace ecorche::tet
