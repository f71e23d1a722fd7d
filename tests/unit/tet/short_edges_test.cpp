// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/short_edges.hpp"

#include <gtest/gtest.h>

#include "core/geometry/dihedral.hpp"
#include "core/geometry/edges.hpp"
#include "preprocess/tet/mesher.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::tet {
namespace {

// Cubes of 10 mm half a metre from the origin, and one node moved to `gap` mm of its neighbour along x.
TetMesh pinched(double gap) {
  TetMesh mesh = test::box_mesh({4, 4, 4}, 10);
  const auto node = [&](double x) {
    Eigen::Index at = 0;
    (mesh.V.rowwise() - Eigen::RowVector3d(x, 20, 20)).rowwise().squaredNorm().minCoeff(&at);
    return at;
  };
  mesh.V(node(10), 0) = 20 - gap;
  mesh.V.rowwise() += Eigen::RowVector3d(500, 100, 900);
  return mesh;
}

double shortest(const TetMesh& mesh) {
  double out = 1e9;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j)
        out = std::min(out, (mesh.V.row(mesh.T(t, i)) - mesh.V.row(mesh.T(t, j))).norm());
  return out;
}

TEST(ShortEdges, ArePartedToWhatFloat32Resolves) {
  TetMesh mesh = pinched(0.004);
  const TetMesh before = mesh;
  const double bound = geometry::unresolved_edge(mesh.V);
  EXPECT_NEAR(bound, 100 * std::exp2(-14), 1e-12);  // steps of float32 between 512 and 1024 mm
  const ShortEdges report = lengthen_short_edges(mesh);
  EXPECT_EQ(report.before, 1);
  EXPECT_EQ(report.after, 0);
  EXPECT_NEAR(report.shortest_mm, 0.004, 1e-9);
  EXPECT_NEAR(report.then_mm, shortest(mesh), 1e-12);
  EXPECT_GT(shortest(mesh), 3 * bound);
  EXPECT_LT((mesh.V - before.V).cwiseAbs().maxCoeff(), 5 * bound);  // hundredths of a mm
  EXPECT_EQ(mesh.T, before.T);
  canonicalize(mesh);  // throws for a tet without volume
  EXPECT_GT(shortest(mesh), bound);
}

TEST(ShortEdges, LongOnesAreLeftAlone) {
  TetMesh mesh = pinched(0.02);
  const Points before = mesh.V;
  EXPECT_EQ(lengthen_short_edges(mesh).before, 0);
  EXPECT_EQ(mesh.V, before);
}

TEST(ShortEdges, NoAngleBecomesWorseThanItWas) {
  TetMesh mesh = pinched(0.004);
  const auto extremes = [](const TetMesh& of) {
    std::pair<double, double> out{180, 0};
    for (Eigen::Index t = 0; t < of.T.rows(); ++t) {
      std::array<Eigen::Vector3d, 4> corner;
      for (int c = 0; c < 4; ++c) corner[static_cast<std::size_t>(c)] = of.V.row(of.T(t, c)).transpose();
      const geometry::TetShape shape = geometry::tet_shape(corner);
      EXPECT_TRUE(shape.sound());
      out = {std::min(out.first, shape.least_deg()), std::max(out.second, shape.greatest_deg())};
    }
    return out;
  };
  const auto before = extremes(mesh);
  lengthen_short_edges(mesh);
  const auto after = extremes(mesh);
  EXPECT_GE(after.first, std::min(before.first, 10.0));
  EXPECT_LE(after.second, std::max(before.second, 165.0));
}

}  // namespace
}  // namespace ecorche::tet
