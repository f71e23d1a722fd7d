// SPDX-License-Identifier: Apache-2.0
// What is asked of CGAL's and TetGen's meshes alone.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/unit/io/scratch.hpp"
#include "tests/unit/tet/bodies.hpp"
#include "tests/unit/tet/tet_measures.hpp"

namespace ecorche::tet {
namespace {

TEST(Tetgen, SurfacesThatCrossAreTakenFromTheVoxels) {
  const Prepared p(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {20, 20, 20}, 8), {shapes::box({5, -3, -3}, {30, 3, 3})}), 2);
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { said.emplace_back(line); };
  Options few;
  few.max_tets = 60'000;
  TetMesh mesh = p.mesh("tetgen", few, context);
  canonicalize(mesh);
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said[0].find("cross others"), std::string::npos) << said[0];
  EXPECT_LE(mesh.T.rows(), few.max_tets);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
  const auto volumes = measures::volumes(mesh);
  ASSERT_EQ(volumes.size(), 2U);
  const double bone = voxel_volume(p.labels, voxel::first_bone);
  const double body = bone + voxel_volume(p.labels, voxel::soft);
  EXPECT_NEAR(volumes.at(0) + volumes.at(1), body, 0.03 * body);
  EXPECT_NEAR(volumes.at(1), bone, 0.15 * bone);
  EXPECT_GT(measures::dihedral_angles(mesh)[0], 4);
}

TEST(Tetgen, AHollowInABoneIsFilledAndOneInTheBodyStays) {
  Prepared p(
      shapes::body(shapes::ellipsoid({0, 0, 0}, {20, 20, 20}, 8), {shapes::box({0, -7, -7}, {30, 7, 7})}), 1);
  const ImageGrid& grid = p.labels.grid;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i) {
        const auto x = grid.point(i, j, k);
        const bool within = std::abs(x[1]) < 3 && std::abs(x[2]) < 3;
        if (within && std::abs(std::abs(x[0]) - 9) < 3)
          p.labels.scalars<std::uint16_t>()[grid.offset(i, j, k)] = voxel::outside;
      }
  Options few;
  few.max_tets = 100'000;
  const TetMesh lattice = p.mesh("lattice", few), mesh = p.mesh("tetgen", few);
  const auto volume_at = [](const TetMesh& m, double x, std::uint16_t label) {
    double sum = 0;
    for (Eigen::Index t = 0; t < m.T.rows(); ++t) {
      Eigen::RowVector3d centre = Eigen::RowVector3d::Zero();
      for (int c = 0; c < 4; ++c) centre += 0.25 * m.V.row(m.T(t, c));
      if (m.label[static_cast<std::size_t>(t)] == label && (centre - Eigen::RowVector3d(x, 0, 0)).norm() < 2)
        sum += measures::volume(m, t);
    }
    return sum;
  };
  EXPECT_EQ(volume_at(lattice, -9, 0), 0);
  EXPECT_EQ(volume_at(lattice, 9, 1), 0) << "hollows to begin with";
  EXPECT_EQ(volume_at(mesh, -9, 0), 0) << "as in every mesher";
  EXPECT_GT(volume_at(mesh, 9, 1), 15);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
  std::vector<bool> used(static_cast<std::size_t>(mesh.V.rows()), false);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (int c = 0; c < 4; ++c) used[static_cast<std::size_t>(mesh.T(t, c))] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

TEST(Tetgen, ASkinThatDoesNotCloseIsTakenFromTheVoxels) {
  Case open = trunk();
  open.skin.F.conservativeResize(open.skin.F.rows() - 1, 3);
  const Prepared p(std::move(open), 2);
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) said.emplace_back(line);
  };
  Options few;
  few.max_tets = 100'000;
  const TetMesh mesh = p.mesh("tetgen", few, context);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(
      said[0].substr(0, said[0].find(" instead")),
      "the skin does not close, so that TetGen found no inside: TetGen fills the surfaces of the voxels");
  EXPECT_EQ(measures::volumes(mesh).size(), 4U);
  EXPECT_EQ(measures::faults_of_boundary(mesh), 0U);
}

TEST(Tetgen, TimeIsLimited) {
  const Prepared p(trunk(), 2);
  Options hurried;
  hurried.seconds = 0;
  std::vector<std::string> said;
  Context context;
  context.log = [&](LogLevel, std::string_view line) { said.emplace_back(line); };
  expect_error(ErrorKind::data,
               "tetgen: TetGen did not come back within 0 s (use --mesher cgal, which works from the voxels)",
               [&] { p.mesh("tetgen", hurried, context); });
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said[0],
            "looking for crossing surfaces took too long: TetGen fills the surfaces of the voxels instead");
}

TEST(Cgal, SmallestAngleIsLifted) {
  const Prepared p(trunk(), 2);
  EXPECT_GT(measures::dihedral_angles(p.mesh("cgal"))[0], 5);
}

TEST(Cgal, FindsPartsThatItsOwnFirstPointsWouldMiss) {
  std::vector<SurfaceMesh> bones;
  bones.reserve(6);
  for (int n = 0; n < 6; ++n)
    bones.push_back(shapes::box({-10.0 + 4 * n, -0.4, -0.4}, {-9.2 + 4 * n, 0.4, 0.4}));
  const Prepared p(shapes::body(shapes::ellipsoid({0, 0, 0}, {16, 16, 16}, 8), bones), 1);
  Options few;
  few.max_tets = 12'000;
  const TetMesh mesh = p.mesh("cgal", few);
  EXPECT_EQ(measures::volumes(mesh).size(), 7U)
      << "six specks of a voxel or two, smaller than the tets around them";
}

}  // namespace
}  // namespace ecorche::tet
