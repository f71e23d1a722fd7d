// SPDX-License-Identifier: Apache-2.0
// Cylinders, planes and ellipses from formulas: exact, and with 1 mm noise, a fifth corrupted, a tenth gone.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "preprocess/rig/cylinder_fit.hpp"
#include "preprocess/rig/ellipse_fit.hpp"
#include "preprocess/rig/plane_fit.hpp"

namespace ecorche::rig {
namespace {

const Eigen::Vector3d kMiddle(70, -60, 425), kAxis = Eigen::Vector3d(0.9, 0.3, -0.2).normalized();
constexpr double kDegree = std::numbers::pi / 180;

double apart_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) / kDegree;
}

// The lower half of a condyle: radius 22, 60 long.
Points half_cylinder(int around = 24, int along = 30) {
  const Eigen::Vector3d u = kAxis.unitOrthogonal(), v = kAxis.cross(u);
  Points out(around * along, 3);
  for (int i = 0; i < around; ++i) {
    const double turn = std::numbers::pi * (i + 0.5) / around;
    for (int j = 0; j < along; ++j) {
      const double at = 60.0 * j / (along - 1) - 30;
      out.row(i * along + j) =
          (kMiddle + 22 * (std::cos(turn) * u + std::sin(turn) * v) + at * kAxis).transpose();
    }
  }
  return out;
}

// An elliptic plate, 20 by 14 mm, its rim and what is inside it or not.
Points plate(bool filled) {
  const Eigen::Vector3d u = kAxis.unitOrthogonal(), v = kAxis.cross(u);
  std::vector<Eigen::Vector3d> points;
  for (const double share : {1.0, 0.8, 0.6, 0.4, 0.2}) {
    if (share < 1 && !filled) break;
    for (int i = 0; i < 120; ++i) {
      const double turn = 2 * std::numbers::pi * i / 120;
      points.push_back(kMiddle + share * (20 * std::cos(turn) * u + 14 * std::sin(turn) * v));
    }
  }
  Points out(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return out;
}

// A tenth gone, the others shaken by `noise` mm, a fifth thrown up to 15 mm away.
Points spoilt(const Points& points, double noise, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> shake(0, noise);
  std::uniform_real_distribution<double> share(0, 1), far(-15, 15);
  Points out(points.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (share(random) < 0.1) continue;
    const bool corrupted = share(random) < 0.2;
    for (int c = 0; c < 3; ++c)
      out(count, c) = points(i, c) + shake(random) / std::sqrt(3.0) + (corrupted ? far(random) : 0);
    ++count;
  }
  return out.topRows(count);
}

TEST(CylinderFit, exact_points_give_the_exact_cylinder) {
  const auto fit = fit_cylinder(half_cylinder());
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->center - kMiddle).norm(), 1e-5);
  EXPECT_LT(apart_deg(fit->axis, kAxis), 1e-4);
  EXPECT_NEAR(fit->radius, 22, 1e-6);
  EXPECT_LT(fit->residual, 1e-6);
  EXPECT_EQ(fit->inlier_share, 1);
  EXPECT_GT(fit->confidence, 0.99);
}

TEST(CylinderFit, spoilt_points_stay_within_two_millimetres_and_two_degrees) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const auto fit = fit_cylinder(spoilt(half_cylinder(), 1, seed));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - kMiddle).cross(kAxis).norm(), 1) << seed;
    EXPECT_LT(std::abs((fit->center - kMiddle).dot(kAxis)), 2) << seed;
    EXPECT_LT(apart_deg(fit->axis, kAxis), 2) << seed;
    EXPECT_NEAR(fit->inlier_share, 0.85, 0.08);
    EXPECT_GT(fit->confidence, 0.5);
  }
}

TEST(CylinderFit, what_is_no_cylinder_has_none) {
  EXPECT_FALSE(fit_cylinder(Points::Random(5, 3)));
  EXPECT_FALSE(fit_cylinder(Points::Constant(20, 3, 1.0)));
  const Points cloud = 30 * Points::Random(400, 3);
  const auto fit = fit_cylinder(cloud);
  EXPECT_LT(fit ? fit->confidence : 0, 0.3);
}

TEST(PlaneFit, exact_and_spoilt_points) {
  const auto exact = fit_plane(plate(true));
  ASSERT_TRUE(exact);
  EXPECT_LT((exact->center - kMiddle).norm(), 1e-9);
  EXPECT_LT(apart_deg(exact->normal, kAxis), 1e-6);
  EXPECT_GT(exact->confidence, 0.99);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const auto fit = fit_plane(spoilt(plate(true), 1, seed));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - kMiddle).norm(), 1.5);
    EXPECT_LT(apart_deg(fit->normal, kAxis), 2);
    EXPECT_LT(fit->inlier_share, 0.95);
  }
  Points line = Points::Zero(30, 3);
  line.col(0).setLinSpaced(0, 29);
  EXPECT_FALSE(fit_plane(line));
  EXPECT_FALSE(fit_plane(Points::Random(2, 3)));
}

TEST(EllipseFit, a_rim_and_a_filled_plate_give_the_exact_ellipse) {
  for (const bool filled : {false, true}) {
    const auto fit = fit_ellipse(plate(filled));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - kMiddle).norm(), 1e-5);
    EXPECT_LT(apart_deg(fit->normal, kAxis), 1e-6);
    EXPECT_LT(apart_deg(fit->major, kAxis.unitOrthogonal()), 1e-4);
    EXPECT_NEAR(fit->long_mm, 20, 1e-6);
    EXPECT_NEAR(fit->short_mm, 14, 1e-6);
    EXPECT_GT(fit->confidence, 0.99);
  }
}

TEST(EllipseFit, spoilt_points_stay_within_two_millimetres) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    const auto fit = fit_ellipse(spoilt(plate(true), 1, seed));
    ASSERT_TRUE(fit);
    EXPECT_LT((fit->center - kMiddle).norm(), 2) << seed;
    EXPECT_LT(apart_deg(fit->normal, kAxis), 2) << seed;
    EXPECT_NEAR(fit->long_mm, 20, 2.5) << seed;
  }
  EXPECT_FALSE(fit_ellipse(Points::Random(4, 3)));
}

}  // namespace
}  // namespace ecorche::rig
