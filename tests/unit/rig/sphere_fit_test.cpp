// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/sphere_fit.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

const Eigen::Vector3d kCenter(120, -340, 910);

// The upper part of a ball, down to `low` radii below the centre.
Points cap(double radius, double low, double noise) {
  return test::part_of(test::ball(kCenter, radius, 24, noise),
                       [&](const Eigen::Vector3d& p) { return p.z() > kCenter.z() - low * radius; })
      .V;
}

TEST(SphereFit, exact_points_give_the_exact_sphere) {
  const auto fit = fit_sphere(cap(24, 0.2, 0));
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->center - kCenter).norm(), 1e-6);
  EXPECT_NEAR(fit->radius, 24, 1e-6);
  EXPECT_LT(fit->residual, 1e-6);
  EXPECT_EQ(fit->inlier_share, 1);
}

TEST(SphereFit, noise_moves_the_centre_by_less_than_half_a_millimetre) {
  for (const double radius : {6.0, 12.0, 24.0}) {
    const auto fit = fit_sphere(cap(radius, 0, 0.3));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - kCenter).norm(), 0.5) << "radius " << radius;
    EXPECT_NEAR(fit->residual, 0.3, 0.06);
  }
}

TEST(SphereFit, a_neck_with_two_fifths_of_the_points_does_not_pull) {
  const Points good = cap(24, 0, 0.3);
  const Eigen::Index bad = good.rows() * 2 / 3;
  Points all(good.rows() + bad, 3);
  all.topRows(good.rows()) = good;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi), down(22, 60);
  for (Eigen::Index i = 0; i < bad; ++i) {
    const double angle = turn(random);
    all.row(good.rows() + i) = kCenter.transpose() + Eigen::RowVector3d(30 + 8 * std::cos(angle),
                                                                        8 * std::sin(angle), -down(random));
  }
  const auto fit = fit_sphere(all);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->center - kCenter).norm(), 0.5);
  EXPECT_NEAR(fit->inlier_share, 0.6, 0.05);
  EXPECT_LT(fit->residual, 2.4);  // 10 % of the radius: a neck is not the joint
}

TEST(SphereFit, flat_and_few_points_have_no_sphere) {
  EXPECT_FALSE(fit_sphere(Points::Random(3, 3)));
  Points flat = Points::Random(60, 3);
  flat.col(2).setConstant(5);
  EXPECT_FALSE(fit_sphere(flat));
  EXPECT_FALSE(fit_sphere(Points::Constant(20, 3, 1.0)));
}

TEST(SphereFit, the_same_points_give_the_same_bits) {
  const Points points = cap(12, 0.1, 0.4);
  const auto a = fit_sphere(points), b = fit_sphere(points);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->center, b->center);
  EXPECT_EQ(a->radius, b->radius);
}

}  // namespace
}  // namespace ecorche::rig
