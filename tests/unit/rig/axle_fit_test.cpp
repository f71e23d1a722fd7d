// SPDX-License-Identifier: Apache-2.0
// The axle of surfaces that turn about one axis with another radius at each place; and where on a bone it is
// looked for.
#include "preprocess/rig/axle_fit.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

#include "preprocess/rig/bone_end.hpp"
#include "preprocess/rig/local_normals.hpp"
#include "tests/unit/rig/axis_angle.hpp"
#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

const Vector3d kAt(30, -20, 400), kAxle = Vector3d(0.95, 0.2, -0.24).normalized();

// From the axis through kAt along kAxle, mm.
double off_axis(const Vector3d& p) {
  return (p - kAt).cross(kAxle).norm();
}

void add(SurfacePoints& to, const Vector3d& at, const Vector3d& normal) {
  to.at.conservativeResize(to.at.rows() + 1, 3);
  to.normal.conservativeResize(to.normal.rows() + 1, 3);
  to.at.bottomRows<1>() = at.transpose();
  to.normal.bottomRows<1>() = normal.normalized().transpose();
  to.area.push_back(1);
}

/// Turned about the axis: 60 rows of 40 points along 50 mm, over `arc` degrees.
SurfacePoints turned(const std::function<double(double)>& radius, double arc) {
  const Vector3d u = kAxle.unitOrthogonal(), v = kAxle.cross(u);
  SurfacePoints out;
  for (int i = 0; i < 40; ++i) {
    const double along = -25 + 50.0 * i / 39;
    const double r = radius(along), slope = (radius(along + 1e-4) - radius(along - 1e-4)) / 2e-4;
    for (int k = 0; k < 30; ++k) {
      const double angle = arc * std::numbers::pi / 180 * k / 29;
      const Vector3d away = std::cos(angle) * u + std::sin(angle) * v;
      add(out, kAt + along * kAxle + r * away, away - slope * kAxle);
    }
  }
  return out;
}

TEST(Axle, cylinders_cones_and_spools_turn_about_their_axis) {
  const std::vector<std::pair<std::function<double(double)>, double>> radii{
      {[](double) { return 20.0; }, 20},
      {[](double along) { return 20 + 0.08 * along; }, 20},
      {[](double along) { return 10 + 3 * along * along / 625; }, 11}};
  for (const auto& [radius, mean] : radii) {
    const auto fit = fit_axle(turned(radius, 150));
    ASSERT_TRUE(fit);
    // What holds the radii together leans the axis of a cone by a third of its half angle, 4.6 degrees here.
    EXPECT_LT(degrees(fit->axis, kAxle), 1.5);
    EXPECT_LT(off_axis(fit->center), 0.5);
    EXPECT_LT((fit->center - kAt).norm(), 1.5);
    EXPECT_NEAR(fit->radius, mean, 0.3);
    EXPECT_GT(fit->inlier_share, 0.95);
    EXPECT_GT(fit->confidence, 0.8);
  }
}

// Two condyles of other radii, a notch between them, flat sides, and a shaft that leaves across.
SurfacePoints condyles() {
  SurfacePoints out = turned([](double along) { return along < 0 ? 21.0 : 23.0; }, 140);
  SurfacePoints kept;
  for (Eigen::Index p = 0; p < out.at.rows(); ++p) {
    const Vector3d at = out.at.row(p).transpose();
    if (std::abs((at - kAt).dot(kAxle)) > 8) add(kept, at, out.normal.row(p).transpose());
  }
  const Vector3d u = kAxle.unitOrthogonal(), v = kAxle.cross(u);
  for (int i = 0; i < 20; ++i) {
    for (int k = 0; k < 20; ++k) {
      const Vector3d across = (i - 10.0) * 1.8 * u + (k - 10.0) * 1.8 * v;
      for (const double side : {-25.0, -8.0, 8.0, 25.0}) add(kept, kAt + side * kAxle + across, side * kAxle);
      add(kept, kAt - 18 * v + 2.4 * (i - 10) * kAxle - 1.5 * k * u, -v);
    }
  }
  return kept;
}

TEST(Axle, two_condyles_of_other_radii_among_sides_notch_and_shaft) {
  const auto fit = fit_axle(condyles());
  ASSERT_TRUE(fit);
  EXPECT_LT(degrees(fit->axis, kAxle), 1.5);
  EXPECT_LT(off_axis(fit->center), 1.5);
  EXPECT_NEAR(fit->radius, 22, 1);
}

TEST(Axle, noise_and_badly_registered_vertices_do_not_turn_it) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    SurfacePoints spoilt = condyles();
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 1 / std::sqrt(3.0));
    std::uniform_real_distribution<double> share(0, 1), far(-15, 15);
    for (Eigen::Index p = 0; p < spoilt.at.rows(); ++p) {
      const bool corrupted = share(random) < 0.2;
      for (int c = 0; c < 3; ++c) spoilt.at(p, c) += noise(random) + (corrupted ? far(random) : 0);
      const bool turned_away = share(random) < 0.6;  // a vertex spoils its neighbours' normals
      if (!turned_away) continue;
      for (int c = 0; c < 3; ++c) spoilt.normal(p, c) += 0.08 * far(random);
      spoilt.normal.row(p).normalize();
    }
    const auto fit = fit_axle(spoilt);
    ASSERT_TRUE(fit);
    EXPECT_LT(degrees(fit->axis, kAxle), 2) << seed;
    EXPECT_LT(off_axis(fit->center), 2) << seed;
    EXPECT_LT(fit->confidence, 0.8) << seed;
  }
}

TEST(Axle, is_sought_where_it_is_expected_only) {
  SurfacePoints across = turned([](double) { return 20.0; }, 150);
  across.along = kAxle.unitOrthogonal();
  const auto fit = fit_axle(across);
  EXPECT_TRUE(!fit || degrees(fit->axis, kAxle) > 25);
  SurfacePoints few;
  EXPECT_FALSE(fit_axle(few));
  for (int i = 0; i < 11; ++i) add(few, Vector3d(i, i * i, 0), Vector3d(0, 0, 1));
  EXPECT_FALSE(fit_axle(few));
  for (int row = 0; row < 10; ++row) {
    for (int i = 0; i < 10; ++i) add(few, Vector3d(i, row, 0), Vector3d(0, 0, 1));
  }
  EXPECT_FALSE(fit_axle(few));  // a plane has no axle
}

TEST(Normals, are_kept_where_the_surface_is_smooth_and_found_again_where_it_is_rough) {
  SurfacePoints flat;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-1, 1);
  for (int i = 0; i < 400; ++i) {
    const Vector3d wild(share(random), share(random), 0.4 + share(random));
    const int row = i / 20;
    add(flat, Vector3d(3 * (i % 20), 3 * row, 0.3 * share(random)), i < 200 ? wild : Vector3d(0, 0, 1));
  }
  SurfacePoints smooth = flat;
  for (Eigen::Index p = 0; p < smooth.at.rows(); ++p)
    smooth.normal.row(p) = Eigen::RowVector3d(0.1, 0, 0.995);
  EXPECT_EQ(local_normals(smooth), smooth.normal);
  for (Eigen::Index p = 0; p < 400; ++p) flat.normal.row(p) = flat.normal.row(p % 200);
  const Points found = local_normals(flat);
  int right = 0;
  for (Eigen::Index p = 0; p < 400; ++p) right += found(p, 2) > 0.95 ? 1 : 0;
  EXPECT_GT(right, 350);
}

// A shaft of 400 mm with a ball of 40 mm at one end, which lies bent by 70 degrees about x.
TEST(End, lies_on_the_side_of_the_other_bone_in_a_frame_that_bends_with_the_limb) {
  const double bend = 70 * std::numbers::pi / 180;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(bend, Vector3d::UnitX()).toRotationMatrix();
  SurfaceMesh bone = test::ball(Vector3d::Zero(), 40, 20);
  for (int k = 1; k < 20; ++k) bone = test::joined(bone, test::ball({0, 0, 20.0 * k}, 15, 10));
  bone.V = bone.V * turn.transpose();
  const Vector3d below = turn * Vector3d(0, 0, -60), above = turn * Vector3d(0, 0, 450);
  const auto end = bone_end(bone, test::ball(below, 15, 10));
  ASSERT_TRUE(end);
  EXPECT_LT(degrees(end->axes.col(2), turn.col(2)), 1);
  EXPECT_LT(degrees(end->axes.col(0), turn.col(0)), 1);
  EXPECT_LT(degrees(end->axes.col(1), turn.col(1)), 1);
  EXPECT_NEAR(end->width, 80, 7);  // the outermost fiftieth on each side is left out
  EXPECT_LT((end->place(turn * Vector3d(0, 40, 0)) - Vector3d(0, 0.5, 0.5)).norm(), 0.08);
  const auto other = bone_end(bone, test::ball(above, 15, 10));
  ASSERT_TRUE(other);
  EXPECT_EQ(other->inward, -1);
  EXPECT_NEAR(other->width, 30, 3);
  EXPECT_NEAR(other->place(turn * Vector3d(0, 0, 365)).z(), 1, 0.15);
  EXPECT_FALSE(bone_end(SurfaceMesh{}, bone));
  EXPECT_FALSE(bone_end(bone, SurfaceMesh{}));
}

}  // namespace
}  // namespace ecorche::rig
