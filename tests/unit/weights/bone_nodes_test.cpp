// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "preprocess/weights/harmonic.hpp"
#include "preprocess/weights/surface_distance.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::weights {
namespace {

/// The square [x, x] x [0, 40] x [0, 40]: the part of a bone's surface that matters here.
SurfaceMesh wall(double x) {
  SurfaceMesh s;
  s.V.resize(4, 3);
  s.V << x, 0, 0, x, 40, 0, x, 40, 40, x, 0, 40;
  s.F.resize(2, 3);
  s.F << 0, 1, 2, 0, 2, 3;
  return s;
}

TEST(BoneNodes, ContestedNodesGoToTheNearestSurface) {
  // Bone 0 fills x < 20, bone 1 the rest: all nodes with x = 20 touch both. Walls: at 19 and at 20.5.
  const TetMesh mesh =
      test::box_mesh({4, 4, 4}, 10, [](const Eigen::Vector3d& p) { return p.x() < 20 ? 1 : 2; });
  Case patient;
  patient.bones = {{"a", "s", wall(19)}, {"b", "t", wall(20.5)}};
  const auto owner = bone_nodes(mesh, patient, {3, 1});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(owner[static_cast<std::size_t>(n)], mesh.V(n, 0) < 20 ? 3 : 1) << mesh.V.row(n);
  }
  // As near to one as to the other: the lower bone.
  patient.bones[1].surface = wall(21);
  const auto tied = bone_nodes(mesh, patient, {3, 1});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(tied[static_cast<std::size_t>(n)], mesh.V(n, 0) <= 20 ? 3 : 1) << mesh.V.row(n);
  }
}

TEST(BoneNodes, BonesOfOneSegmentDoNotContest) {
  const TetMesh mesh = test::box_mesh({4, 1, 1}, 10, [](const Eigen::Vector3d& p) {
    return p.x() < 20 ? 1 : p.x() < 30 ? 2 : 0;
  });
  Case patient;
  patient.bones.resize(2);  // no surfaces: nobody may ask
  const auto owner = bone_nodes(mesh, patient, {5, 5});
  for (Eigen::Index n = 0; n < mesh.V.rows(); ++n) {
    EXPECT_EQ(owner[static_cast<std::size_t>(n)], mesh.V(n, 0) <= 30 ? 5 : -1);
  }
}

TEST(BoneNodes, RefusesALabelWithoutABone) {
  const TetMesh mesh = test::box_mesh({1, 1, 1}, 10, [](const Eigen::Vector3d&) { return 3; });
  EXPECT_THROW(bone_nodes(mesh, Case{}, {0, 1}), Error);
}

TEST(SurfaceDistance, EqualsTheSearchOverAllTriangles) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> at(-50, 50), edge(-8, 8);
  SurfaceMesh soup;
  const int triangles = 300;
  soup.V.resize(3 * triangles, 3);
  soup.F.resize(triangles, 3);
  for (int f = 0; f < triangles; ++f) {
    const Eigen::RowVector3d middle(at(random), at(random), at(random));
    for (int k = 0; k < 3; ++k) {
      soup.F(f, k) = 3 * f + k;
      soup.V.row(3 * f + k) = middle + Eigen::RowVector3d(edge(random), edge(random), edge(random));
    }
    if (f % 50 == 0) soup.V.row(3 * f + 1) = soup.V.row(3 * f);  // degenerate
  }
  const SurfaceDistance tree(soup);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p(2 * at(random), 2 * at(random), at(random));
    double best = 1e300;
    for (int f = 0; f < triangles; ++f) {
      // By sampling barycentrics: an upper bound, and near enough to catch a wrong region.
      const Eigen::Vector3d a = soup.V.row(3 * f), b = soup.V.row(3 * f + 1), c = soup.V.row(3 * f + 2);
      const double d = squared_distance_to_triangle(p, a, b, c);
      double sampled = 1e300;
      for (int u = 0; u <= 20; ++u) {
        for (int v = 0; u + v <= 20; ++v) {
          sampled = std::min(sampled, (a + (b - a) * (u / 20.0) + (c - a) * (v / 20.0) - p).squaredNorm());
        }
      }
      EXPECT_LE(d, sampled * (1 + 1e-9));
      EXPECT_GT(std::sqrt(d), std::sqrt(sampled) - 1.5);  // samples are about 1 mm apart
      best = std::min(best, d);
    }
    EXPECT_DOUBLE_EQ(tree.squared(p), best);
  }
  EXPECT_EQ(SurfaceDistance(SurfaceMesh{}).squared({0, 0, 0}), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace ecorche::weights
