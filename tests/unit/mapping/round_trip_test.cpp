// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/round_trip.hpp"

#include <gtest/gtest.h>

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

// The second lands on the first: its centroid (1/2, 1/2, 1/2) + (x) lies in no other, but moved by -10.3 it
// is in the first, whose points are at home there; so it comes back 10.3 away, and it weighs 8 of 9.
TEST(RoundTrip, WhatLiesUnderAnotherComesBackAsTheOther) {
  const Two two;
  PointsF posed = two.rest;
  posed.row(4).array() = 0.1F;  // shrunk into the first, its centroid at 0.1 + 0.1 / 4
  posed.row(5) << 0.2F, 0.1F, 0.1F;
  posed.row(6) << 0.1F, 0.2F, 0.1F;
  posed.row(7) << 0.1F, 0.1F, 0.2F;
  const RoundTrip trip = round_trip(two.rest, posed, two.tets, {});
  const double moved = (Eigen::Vector3d(10.5, 0.5, 0.5) - Eigen::Vector3d::Constant(0.125)).norm();
  EXPECT_NEAR(trip.max_mm, moved, 1e-6);
  EXPECT_NEAR(trip.elsewhere_share, 8.0 / 9, 1e-12);
  EXPECT_NEAR(trip.mean_mm, moved * 8 / 9, 1e-6);
  EXPECT_EQ(trip.mean_voxels, trip.mean_mm);
  // Counted in voxels, of 2 x 1 x 4 mm.
  const Eigen::Vector3d away(10.375 / 2, 0.375, 0.375 / 4);
  EXPECT_NEAR(
      round_trip(two.rest, posed, two.tets, {}, Eigen::Vector3d(0.5, 1, 0.25).asDiagonal()).mean_voxels,
      away.norm() * 8 / 9, 1e-6);
}

// An inverted tet holds nothing where another lies, and keeps its own where none does.
TEST(RoundTrip, InvertedTetsComeLast) {
  const Two two;
  PointsF posed = two.rest;
  posed.row(0).swap(posed.row(1));
  EXPECT_EQ(round_trip(two.rest, posed, two.tets, {}).mean_mm, 0);
  posed.bottomRows(4) = two.rest.topRows(4);  // now the second lies upright where the first lies inverted
  const RoundTrip trip = round_trip(two.rest, posed, two.tets, {});
  EXPECT_NEAR(trip.elsewhere_share, 1.0 / 9, 1e-12);
}

}  // namespace
}  // namespace ecorche::mapping
