// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/facing.hpp"

#include <gtest/gtest.h>

#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

TEST(Facing, the_head_in_its_socket_and_nothing_of_the_shaft) {
  const SurfaceMesh head = test::ball({0, 0, 0}, 24, 24);
  const SurfaceMesh shaft = test::ball({0, 0, -90}, 20, 12);  // another lump of the same bone
  const SurfaceMesh bone = test::joined(head, shaft);
  const SurfaceMesh socket = test::part_of(test::ball({0, 0, 0}, 27, 24, 0, true),
                                           [](const Eigen::Vector3d& p) { return p.z() > -1; });
  const Points found = facing_vertices(bone, socket);
  EXPECT_GT(found.rows(), 400);
  EXPECT_GT(found.col(2).minCoeff(), -12);
  for (Eigen::Index i = 0; i < found.rows(); ++i) EXPECT_NEAR(found.row(i).norm(), 24, 1e-9);
}

TEST(Facing, a_thin_wall_shows_only_its_inner_side) {
  const auto upper = [](const Eigen::Vector3d& p) { return p.z() > -1; };
  const SurfaceMesh inner = test::part_of(test::ball({0, 0, 0}, 26, 24, 0, true), upper);
  const SurfaceMesh outer = test::part_of(test::ball({0, 0, 0}, 27.5, 24), upper);
  const Points found = facing_vertices(test::joined(inner, outer), test::ball({0, 0, 0}, 24, 24));
  ASSERT_GT(found.rows(), 300);
  for (Eigen::Index i = 0; i < found.rows(); ++i) EXPECT_NEAR(found.row(i).norm(), 26, 1e-9);
}

TEST(Facing, an_empty_bone_faces_nothing) {
  const SurfaceMesh ball = test::ball({0, 0, 0}, 24, 8);
  EXPECT_EQ(facing_vertices(SurfaceMesh{Points(0, 3), Triangles(0, 3)}, ball).rows(), 0);
  EXPECT_EQ(facing_vertices(ball, SurfaceMesh{Points(0, 3), Triangles(0, 3)}).rows(), 0);
}

}  // namespace
}  // namespace ecorche::rig
