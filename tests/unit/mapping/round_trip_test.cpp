// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/round_trip.hpp"

#include <gtest/gtest.h>

#include <random>

#include "preprocess/geometry/closest_point.hpp"
#include "preprocess/mapping/tet_corners.hpp"
#include "preprocess/mapping/tet_grid.hpp"

namespace ecorche::mapping {
namespace {

// Two tets apart, of volumes 1 and 8 sixths.
struct Two {
  PointsF rest{8, 3};
  Tets tets{2, 4};

  Two() {
    rest << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 10, 0, 0, 12, 0, 0, 10, 2, 0, 10, 0, 2;
    tets << 0, 1, 2, 3, 4, 5, 6, 7;
  }
};

TEST(RoundTrip, AMotionWithoutOverlapForgetsNothing) {
  const Two two;
  PointsF posed = two.rest * 2;
  posed.col(1) += posed.col(0);
  const RoundTrip trip = round_trip(two.rest, posed, two.tets, {});
  EXPECT_EQ(trip.points, 2u);
  EXPECT_EQ(trip.mean_mm, 0);
  EXPECT_EQ(trip.max_mm, 0);
  EXPECT_EQ(trip.elsewhere_share, 0);
}

// The second lands about the first, three times as wide: a third of it would be the first's place.
PointsF second_about_first(const Two& two) {
  PointsF posed = two.rest;
  posed.bottomRows(4) = ((two.rest.bottomRows(4).rowwise() - two.rest.row(4)) * 3).array() - 1.3F;
  return posed;
}

// Its centroid, (0.2, 0.2, 0.2), lies in the first, which is as it was and so squeezed more: it comes back as
// that, 10.3 away, and it weighs 8 of 9. The first's centroid is at home.
TEST(RoundTrip, WhatLiesUnderAnotherComesBackAsTheOther) {
  const Two two;
  const PointsF posed = second_about_first(two);
  const RoundTrip trip = round_trip(two.rest, posed, two.tets, {});
  const Eigen::Vector3d away(10.3, 0.3, 0.3);
  EXPECT_NEAR(trip.max_mm, away.norm(), 1e-6);
  EXPECT_NEAR(trip.elsewhere_share, 8.0 / 9, 1e-12);
  EXPECT_NEAR(trip.mean_mm, away.norm() * 8 / 9, 1e-6);
  EXPECT_EQ(trip.mean_voxels, trip.mean_mm);
  // Counted in voxels, of 2 x 1 x 4 mm.
  const Eigen::Vector3d voxels(10.3 / 2, 0.3, 0.3 / 4);
  EXPECT_NEAR(
      round_trip(two.rest, posed, two.tets, {}, Eigen::Vector3d(0.5, 1, 0.25).asDiagonal()).mean_voxels,
      voxels.norm() * 8 / 9, 1e-6);
}

TEST(RoundTrip, WhatIsSqueezedMostComesBack) {
  const Two two;
  PointsF posed = two.rest;  // the second, small, in the first: all of it is where little of that is
  posed.row(4).array() = 0.1F;
  posed.row(5) << 0.4F, 0.1F, 0.1F;
  posed.row(6) << 0.1F, 0.4F, 0.1F;
  posed.row(7) << 0.1F, 0.1F, 0.4F;  // both centroids in it
  posed.bottomRows(4).array() += 0.05F;
  const RoundTrip trip = round_trip(two.rest, posed, two.tets, {});
  EXPECT_NEAR(trip.elsewhere_share, 1.0 / 9, 1e-12);
}

// Points of an inverted tet are squeezed like others.
TEST(RoundTrip, AnInvertedTetKeepsItsPoints) {
  const Two two;
  PointsF posed = two.rest;
  posed.row(0).swap(posed.row(1));
  EXPECT_EQ(round_trip(two.rest, posed, two.tets, {}).mean_mm, 0);
  posed = second_about_first(two);
  posed.row(0).swap(posed.row(1));
  EXPECT_NEAR(round_trip(two.rest, posed, two.tets, {}).elsewhere_share, 8.0 / 9, 1e-12);
  posed.row(2) = posed.row(3);  // flat, it holds nothing: what of it lies in the second comes back as that
  EXPECT_NEAR(round_trip(two.rest, posed, two.tets, {}).elsewhere_share, 1.0 / 9, 1e-12);
}

// The slow twin: every tet.
std::int32_t most_squeezed_of_all(const Eigen::Vector3d& p, const PointsF& rest, const PointsF& posed,
                                  const Tets& tets) {
  std::int32_t found = -1;
  double most = 0;
  for (Eigen::Index t = 0; t < tets.rows(); ++t) {
    const auto now = corners_of(posed, tets, t), was = corners_of(rest, tets, t);
    const double det = std::abs(tet_det(now[0], now[1], now[2], now[3]));
    if (det == 0 || geometry::barycentric(p, now).minCoeff() < 0) continue;
    const double squeezed = std::abs(tet_det(was[0], was[1], was[2], was[3])) / det;
    if (squeezed <= most) continue;
    most = squeezed;
    found = static_cast<std::int32_t>(t);
  }
  return found;
}

TEST(MostSqueezed, IsThatOfASearchThroughAll) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(0, 10);
  PointsF rest(240, 3), posed(240, 3);
  for (float& x : rest.reshaped()) x = place(random);
  for (float& x : posed.reshaped()) x = place(random);
  Tets tets(300, 4);                      // a heap of them, half inverted
  for (Eigen::Index t = 0; t < 300; ++t)  // four different nodes each
    for (int c = 0; c < 4; ++c)
      tets(t, c) = static_cast<std::int32_t>(60 * c + static_cast<int>(random() % 60));
  const TetGrid grid(posed, tets, {});
  int held = 0, inverted = 0;
  Points points(500, 3);
  for (double& x : points.reshaped()) x = static_cast<double>(place(random)) * 1.2 - 1;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const Eigen::Vector3d at = points.row(p).transpose();
    const std::int32_t tet = most_squeezed_of_all(at, rest, posed, tets);
    EXPECT_EQ(grid.most_squeezed(at, rest), tet);
    if (tet < 0) continue;
    ++held;
    const auto now = corners_of(posed, tets, tet);
    inverted += tet_det(now[0], now[1], now[2], now[3]) < 0 ? 1 : 0;
  }
  EXPECT_GT(held, 100);
  EXPECT_GT(inverted, 30);
  EXPECT_EQ(TetGrid(posed, Tets(0, 4), {}).most_squeezed({1, 2, 3}, rest), -1);

  // Bound by it, a point has that tet, and shares that give its place back.
  Binding binding = Locator(posed, tets).bind(points, {});
  const Binding before = binding;
  bind_to_most_squeezed(points, rest, posed, tets, binding, {});
  std::uint64_t outside = 0;
  for (Eigen::Index p = 0; p < points.rows(); ++p) {
    const auto row = static_cast<std::size_t>(p);
    const std::int32_t tet = most_squeezed_of_all(points.row(p).transpose(), rest, posed, tets);
    EXPECT_EQ(binding.tet[row], tet < 0 ? before.tet[row] : tet);
    outside += tet < 0 ? 1 : 0;
    EXPECT_EQ(binding.outside_mm[row] == 0, tet >= 0);
    const auto corners = corners_of(posed, tets, binding.tet[row]);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 4; ++c)
      at += static_cast<double>(binding.barycentric(p, static_cast<Eigen::Index>(c))) * corners[c];
    if (tet >= 0) {
      EXPECT_LT((at - points.row(p).transpose()).norm(), 1e-4);
    }
  }
  EXPECT_EQ(binding.outside, outside);
  EXPECT_GE(before.outside, outside);
}

}  // namespace
}  // namespace ecorche::mapping
