// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "preprocess/check/touching_limbs.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

// Points of a sphere, evenly spread (Fibonacci).
PointsF sphere(Eigen::Index count, double radius, const Vector3d& centre) {
  PointsF out(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double turn = std::numbers::pi * (1 + std::sqrt(5.0)) * static_cast<double>(i);
    const double r = std::sqrt(1 - z * z);
    out.row(i) =
        (centre + radius * Vector3d(r * std::cos(turn), r * std::sin(turn), z)).cast<float>().transpose();
  }
  return out;
}

TEST(WayToSkin, is_the_radius_of_a_ball_and_the_near_side_of_one_beside) {
  EXPECT_NEAR(way_to_skin(sphere(5000, 80, {1, 2, 3}), {1, 2, 3}), 80, 1e-3);
  const double beside = way_to_skin(sphere(5000, 80, {30, 0, 0}), {0, 0, 0});
  EXPECT_GT(beside, 50);
  EXPECT_LT(beside, 55);
}

TEST(WayToSkin, does_not_mind_a_narrow_fold_and_knows_no_skin) {
  PointsF skin = sphere(5000, 80, {0, 0, 0});
  for (Eigen::Index v = 0; v < skin.rows(); ++v) {
    if (skin(v, 2) > 78) skin.row(v) *= 0.3F;
  }
  EXPECT_NEAR(way_to_skin(skin, {0, 0, 0}), 80, 1);
  EXPECT_TRUE(std::isinf(way_to_skin(PointsF(0, 3), {0, 0, 0})));
}

TEST(OuterVertices, are_without_those_of_hollows) {
  // Two tetrahedra, the inner one turned inwards.
  PointsF V(8, 3);
  V << 0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9, 1, 1, 1, 2, 1, 1, 1, 2, 1, 1, 1, 2;
  Triangles F(8, 3);
  F << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3, 4, 5, 6, 4, 7, 5, 4, 6, 7, 5, 7, 6;
  EXPECT_EQ(outer_vertices(V, F), V.topRows(4));
}

}  // namespace
}  // namespace ecorche::check
