// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/relax_slivers.hpp"

#include <gtest/gtest.h>

#include <random>

#include "preprocess/tet/mesher.hpp"
#include "tests/unit/tet/tet_measures.hpp"

namespace ecorche::tet {
namespace {

// Kuhn's six tets in every cell of an n^3 grid of 10 mm, the upper half of another label, inner nodes shaken.
TetMesh shaken_box(int n, double shake) {
  TetMesh mesh;
  const auto node = [n](int i, int j, int k) { return i + (n + 1) * (j + (n + 1) * k); };
  mesh.V.resize(node(n, n, n) + 1, 3);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> off(-shake, shake);
  for (int k = 0; k <= n; ++k) {
    for (int j = 0; j <= n; ++j) {
      for (int i = 0; i <= n; ++i) {
        const bool inner = i % n != 0 && j % n != 0 && k % n != 0 && 2 * k != n;
        mesh.V.row(node(i, j, k)) << 10.0 * i, 10.0 * j, 10.0 * k;
        if (inner) mesh.V.row(node(i, j, k)) += Eigen::RowVector3d(off(random), off(random), off(random));
      }
    }
  }
  std::vector<std::array<int, 4>> tets;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        std::array<int, 3> axes{0, 1, 2};
        do {
          std::array<int, 3> at{i, j, k};
          std::array<int, 4> tet{node(i, j, k), 0, 0, 0};
          for (std::size_t step = 0; step < 3; ++step) {
            ++at[static_cast<std::size_t>(axes[step])];
            tet[step + 1] = node(at[0], at[1], at[2]);
          }
          tets.push_back(tet);
          mesh.label.push_back(2 * k < n ? 0 : 1);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
    }
  }
  mesh.T.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    for (int c = 0; c < 4; ++c) mesh.T(t, c) = tets[static_cast<std::size_t>(t)][static_cast<std::size_t>(c)];
    if (measures::volume(mesh, t) < 0) std::swap(mesh.T(t, 2), mesh.T(t, 3));
  }
  return mesh;
}

TEST(RelaxSlivers, RaisesTheSmallestAngleAndKeepsEverythingElse) {
  TetMesh mesh = shaken_box(8, 3.2);
  const TetMesh before = mesh;
  ASSERT_GT(measures::smallest_volume(mesh), 0);
  const double worst = measures::dihedral_angles(mesh)[0];
  ASSERT_LT(worst, 10);
  const SliverReport report = relax_slivers(mesh, {}, {});
  EXPECT_GT(report.before, 10);
  EXPECT_EQ(report.after, 0);
  EXPECT_GE(measures::dihedral_angles(mesh)[0], 10);
  EXPECT_LE(measures::dihedral_angles(mesh)[1], 165);
  EXPECT_GT(measures::smallest_volume(mesh), 0);
  EXPECT_EQ(mesh.T, before.T);
  EXPECT_EQ(mesh.label, before.label);
  EXPECT_LE(report.largest_surface_move_mm, 2.5 + 1e-9);
}

TEST(RelaxSlivers, LeavesAGoodMeshAlone) {
  TetMesh mesh = shaken_box(4, 0);
  const TetMesh before = mesh;
  const SliverReport report = relax_slivers(mesh, {}, {});
  EXPECT_EQ(report.before, 0);
  EXPECT_TRUE(measures::same(mesh, before));
}

TEST(RelaxSlivers, IsDeterministicAndStops) {
  TetMesh a = shaken_box(6, 3.2), b = a;
  relax_slivers(a, {}, {});
  relax_slivers(b, {}, {});
  EXPECT_TRUE(measures::same(a, b));
  std::stop_source stop;
  stop.request_stop();
  Context context;
  context.stop = stop.get_token();
  TetMesh c = shaken_box(6, 3.2);
  EXPECT_THROW(relax_slivers(c, {}, context), Error);
}

}  // namespace
}  // namespace ecorche::tet
