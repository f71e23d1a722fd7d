// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/effects.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "runtime/spheres/coverage.hpp"
#include "runtime/spheres/morph.hpp"
#include "runtime/spheres/preview.hpp"
#include "runtime/spheres/refill.hpp"
#include "runtime/spheres/spatial_index.hpp"
#include "runtime/spheres/tears.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/spheres/bent_cylinder.hpp"
#include "tests/unit/spheres/exhaustive.hpp"

namespace ecorche::runtime {
namespace {

using test::BentCylinder;

Skeleton two_segments(const BentCylinder& body) {
  Skeleton rig;
  rig.segments.resize(2);
  rig.segments[0].name = "low";
  rig.segments[1].name = "high";
  rig.segments[1].parent = 0;
  const auto at =
      body.skeleton.grid.point(BentCylinder::radius + 2, BentCylinder::radius + 2, BentCylinder::bend);
  rig.segments[1].joint.center = {at[0], at[1], at[2]};
  return rig;
}

BallSet posed(const BentCylinder& body, double degrees) {
  BallSet set = balls_at_rest(body.skeleton, body.skeleton.grid);
  move_balls(body.skeleton, body.bent(degrees), set);
  return set;
}

BallSet balls(const std::vector<std::pair<Vec3, double>>& centres_and_radii, int edge) {
  BallSet set;
  set.lattice.size = {edge, edge, edge};
  set.back = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (const auto& [c, r] : centres_and_radii) set.balls.push_back({c, c, r * r, r * r, 0});
  return set;
}

double ball_volume(double r) {
  return 4 * std::numbers::pi * r * r * r / 3;
}

// Of the lens of two balls, Weisstein: Sphere-Sphere Intersection, eq. 16.
double lens(double a, double b, double d) {
  return std::numbers::pi * std::pow(a + b - d, 2) *
         (d * d + 2 * d * b - 3 * b * b + 2 * d * a + 6 * b * a - 3 * a * a) / (12 * d);
}

TEST(Coverage, CountsTheExactVolumeOfUnions) {
  const double a = 24.3, b = 17.8, d = 27.1;
  const auto counted = [](const BallSet& set) {
    return static_cast<double>(covered_voxels(set, grown_box(set)));
  };
  // The count of lattice points in a ball is its volume up to a part of its surface.
  EXPECT_NEAR(counted(balls({{{30, 30, 30}, a}}, 60)) / ball_volume(a), 1, 3e-3);
  const BallSet two = balls({{{30, 30, 30}, a}, {{30, 30 + d, 30}, b}}, 60);
  EXPECT_NEAR(counted(two) / (ball_volume(a) + ball_volume(b) - lens(a, b, d)), 1, 3e-3);
  EXPECT_NEAR(counted(balls({{{30, 30, 30}, a}, {{33, 30, 30}, 12}}, 60)) / ball_volume(a), 1,
              3e-3);  // one in the other
  const Image mask = covered(two, grown_box(two));
  std::size_t ones = 0;
  for (const std::uint8_t v : mask.scalars<std::uint8_t>()) ones += v;
  EXPECT_EQ(static_cast<double>(ones), counted(two));
}

TEST(Coverage, PartsHangTogetherByCorners) {
  Image mask(ImageGrid{{6, 6, 6}}, ScalarType::u8);
  const auto set = [&](int i, int j, int k) { mask.scalars<std::uint8_t>()[mask.grid.offset(i, j, k)] = 1; };
  set(0, 0, 0), set(1, 1, 1), set(2, 0, 2);  // by corners
  set(5, 5, 5), set(4, 5, 5);
  set(0, 5, 0);
  EXPECT_EQ(parts_of(mask, 1), 3U);
  EXPECT_EQ(parts_of(mask, 2), 2U);
  EXPECT_EQ(parts_of(mask, 3), 1U);
  set(3, 1, 3), set(4, 2, 4), set(4, 3, 5), set(3, 4, 4);  // a bridge, backwards too
  EXPECT_EQ(parts_of(mask, 1), 2U);
}

// Every pair of voxels, twice as slow as it looks.
std::size_t slow_parts(const Image& mask, int reach) {
  std::vector<std::array<int, 3>> voxels;
  for (int k = 0; k < mask.grid.size[2]; ++k)
    for (int j = 0; j < mask.grid.size[1]; ++j)
      for (int i = 0; i < mask.grid.size[0]; ++i)
        if (mask.scalars<std::uint8_t>()[mask.grid.offset(i, j, k)] != 0) voxels.push_back({i, j, k});
  std::vector<std::size_t> piece(voxels.size());
  std::iota(piece.begin(), piece.end(), std::size_t{0});
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t a = 0; a < voxels.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        int apart = 0;
        for (std::size_t c = 0; c < 3; ++c) apart = std::max(apart, std::abs(voxels[a][c] - voxels[b][c]));
        if (apart > reach || piece[a] == piece[b]) continue;
        piece[a] = piece[b] = std::min(piece[a], piece[b]);
        changed = true;
      }
  }
  return std::set<std::size_t>(piece.begin(), piece.end()).size();
}

TEST(Coverage, PartsAreThoseOfASearchOfAllPairs) {
  std::mt19937 random(26);
  for (int trial = 0; trial < 60; ++trial) {
    Image mask(ImageGrid{{11, 7, 5}}, ScalarType::u8);
    const unsigned share = 8 + random() % 30;
    for (std::uint8_t& v : mask.scalars<std::uint8_t>()) v = random() % share == 0 ? 1 : 0;
    EXPECT_EQ(parts_of(mask, 1), slow_parts(mask, 1)) << trial;
    EXPECT_EQ(parts_of(mask, 1, Gap::one_voxel), slow_parts(mask, 2)) << trial;
  }
}

TEST(Effects, AtTimeZeroNothingChanges) {
  const BentCylinder body(0.3);
  const Skeleton rig = two_segments(body);
  const BallSet before = posed(body, 30);
  BallSet set = before;
  bulge(set, rig, bulges_of(set, rig, 0.5), 0);
  melt(set, 0);
  explode(set, 0, 3);
  for (std::size_t b = 0; b < set.balls.size(); ++b) {
    EXPECT_EQ(set.balls[b].radius2, before.balls[b].radius2);
    EXPECT_EQ(set.balls[b].centre, before.balls[b].centre);
  }
}

TEST(Effects, MeltingTakesSmallRadiiFirst) {
  const BentCylinder body(0.3);
  std::size_t before = 1U << 30;
  for (const double time : {0.0, 0.4, 0.8, 0.999, 1.0}) {
    BallSet set = posed(body, 0);
    melt(set, time);
    double least = 1e9, largest = 0;
    std::size_t left = 0;
    for (const Ball& ball : set.balls) {
      largest = std::max(largest, ball.rest_radius2);
      if (ball.radius2 == 0) continue;
      ++left;
      least = std::min(least, ball.radius2);
    }
    if (left > 0) {
      EXPECT_GT(least, time * time * largest);
    }
    EXPECT_LE(left, before);
    before = left;
  }
  EXPECT_EQ(before, 0U);
}

TEST(Effects, ExplosionKeepsTheMeanAndScalesEveryWay) {
  BallSet set = balls({{{10, 10, 10}, 3}, {{20, 10, 10}, 3}, {{15, 25, 10}, 3}}, 40);
  explode(set, 0.5, 2);
  EXPECT_NEAR(set.balls[1].centre[0] - set.balls[0].centre[0], 20, 1e-12);
  EXPECT_NEAR(set.balls[0].centre[1] + set.balls[1].centre[1] + set.balls[2].centre[1], 45, 1e-12);
  const Image mask = covered(set, grown_box(set));
  EXPECT_EQ(parts_of(mask, 1), 3U);
}

// 1 + T G (1 - (d / r)^2)^2 within r, 1 beyond, of the joint's two segments.
TEST(Effects, ABulgeFallsOffWithTheFourthPower) {
  BallSet set = balls({{{10, 10, 10}, 2}, {{13, 10, 10}, 2}, {{10, 14, 10}, 2}, {{18.5, 10, 10}, 2}}, 30);
  set.back.resize(3, set.back[0]);
  set.balls[2].motion = 2;
  Skeleton rig;
  rig.segments.resize(3);
  for (std::size_t s = 1; s < 3; ++s) {
    rig.segments[s].parent = static_cast<int>(s) - 1;
    rig.segments[s].joint.center = {10, 10, 10};
  }
  bulge(set, rig, std::vector<JointBulge>{{1, 8, 0.5}}, 0.6);
  const auto grown = [](double d) { return 1 + 0.6 * 0.5 * std::pow(1 - d * d / 64, 2); };
  EXPECT_NEAR(std::sqrt(set.balls[0].radius2), 2 * grown(0), 1e-12);
  EXPECT_NEAR(std::sqrt(set.balls[1].radius2), 2 * grown(3), 1e-12);
  EXPECT_EQ(set.balls[2].radius2, 4);  // another segment's
  EXPECT_EQ(set.balls[3].radius2, 4);  // beyond
}

TEST(Effects, ABulgeAddsAShellOfTheBallsOwnRim) {
  const BentCylinder body(0.3);
  const Skeleton rig = two_segments(body);
  BallSet set = posed(body, 0);
  const auto bulges = bulges_of(set, rig, 0.4);
  ASSERT_EQ(bulges.size(), 1U);
  const std::size_t plain = covered_voxels(set, grown_box(set));
  bulge(set, rig, bulges, 1);
  const LatticeBox box = grown_box(set);
  EXPECT_GT(covered_voxels(set, box), plain);
  // Every covered voxel shows flesh: rest places stay within the object.
  const Image image = refill(set, box, body.volume, 7, Sampling::nearest);
  const Image mask = covered(set, box);
  std::size_t shell = 0, foreign = 0;
  for (std::size_t v = 0; v < image.grid.voxels(); ++v) {
    if (mask.scalars<std::uint8_t>()[v] == 0) continue;
    const auto value = image.scalars<std::uint8_t>()[v];
    foreign += value != 1 && value != 2;
    ++shell;
  }
  EXPECT_EQ(foreign, 0U);
  EXPECT_GT(shell, plain);
  BallSet less = posed(body, 0);
  bulge(less, rig, bulges_of(less, rig, -0.4), 1);
  EXPECT_LT(covered_voxels(less, grown_box(less)), plain);
}

TEST(Morph, EndsAreTheTwoObjects) {
  const BentCylinder body(0.3);
  const BallSet from = posed(body, 0), to = posed(body, 60);
  Image other = body.volume;
  for (std::uint8_t& v : other.scalars<std::uint8_t>()) v = v == 0 ? 0 : static_cast<std::uint8_t>(v + 100);
  for (const Sampling sampling : {Sampling::nearest, Sampling::trilinear}) {
    const MorphSide a{from, body.volume}, b{to, other};
    EXPECT_TRUE(morph(a, b, 0, 0, sampling).bytes ==
                refill(from, grown_box(from), body.volume, 0, sampling).bytes);
    EXPECT_TRUE(morph(a, b, 1, 0, sampling).bytes == refill(to, grown_box(to), other, 0, sampling).bytes);
    // Halfway, about as large as the two, and no value beyond theirs.
    const Image half = morph(a, b, 0.5, 0, sampling);
    std::size_t held = 0;
    for (const std::uint8_t v : half.scalars<std::uint8_t>()) held += v != 0;
    EXPECT_GT(held, covered_voxels(from, grown_box(from)) / 2);
  }
  EXPECT_THROW(morph({from, body.volume}, {to, other}, 1.5, 0, Sampling::nearest), Error);
  BallSet none = to;
  none.balls.clear();
  expect_error(ErrorKind::data, "morph: a skeleton has no voxel (thin at a lower TP)", [&] {
    morph({from, body.volume}, {none, other}, 0.5, 0, Sampling::nearest);
  });
  EXPECT_THROW(
      morph({from, body.volume}, {to, Image(other.grid, ScalarType::i16)}, 0.5, 0, Sampling::nearest), Error);
}

// Of one body into itself with other values: everywhere their mean by time, or, nearest, the nearer one's.
TEST(Morph, ValuesGoFromTheOneToTheOther) {
  const BentCylinder body(0.3);
  const BallSet set = posed(body, 0);
  const LatticeBox box = grown_box(set);
  Image one(body.volume.grid, ScalarType::f32), two = one;
  for (float& v : one.scalars<float>()) v = 10;
  for (float& v : two.scalars<float>()) v = 50;
  for (const auto& [time, sampling, expected] : {std::tuple{0.25, Sampling::trilinear, 20.0F},
                                                 {0.75, Sampling::trilinear, 40.0F},
                                                 {0.25, Sampling::nearest, 10.0F},
                                                 {0.75, Sampling::nearest, 50.0F}}) {
    const Image image = morph({set, one}, {set, two}, time, -1, sampling);
    std::size_t held = 0;
    for (const float v : image.scalars<float>()) {
      if (v < 0) continue;
      ++held;
      ASSERT_FLOAT_EQ(v, expected);
    }
    EXPECT_EQ(held, covered_voxels(set, box));
  }
}

TEST(SpatialIndex, TheWayFollowsTheTree) {
  VolumetricSkeleton y;  // a Y: 0-1-2, then 3-4 and 5-6
  y.grid.size = {20, 20, 20};
  y.voxel = {{5, 5, 0}, {5, 5, 3}, {5, 5, 6}, {2, 5, 9}, {0, 5, 12}, {8, 5, 9}, {10, 5, 12}};
  y.parent = {-1, 0, 1, 2, 3, 2, 5};
  y.distance.assign(7, 4);
  EXPECT_EQ(path_between(y, {0, 5, 13}, {11, 5, 12}), (std::vector<std::size_t>{4, 3, 2, 5, 6}));
  EXPECT_EQ(path_between(y, {5, 5, 0}, {0, 5, 12}), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(path_between(y, {5, 5, 6}, {5, 5, 6}), (std::vector<std::size_t>{2}));
  y.parent[5] = -1;
  expect_error(ErrorKind::data,
               "the two places lie in parts that hang together with nothing (choose places in one part)",
               [&] {
                 path_between(y, {0, 5, 13}, {11, 5, 12});
               });
  y.parent[2] = 3;
  expect_error(ErrorKind::data, "its tree has a cycle (thin the volume again)", [&] {
    path_between(y, {0, 5, 13}, {5, 5, 0});
  });
  y.parent.clear();
  EXPECT_THROW(path_between(y, {0, 5, 13}, {11, 5, 12}), Error);
}

TEST(SpatialIndex, ContactIsThatOfEveryPair) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> at(0, 60), radius(0, 6);
  for (int round = 0; round < 20; ++round) {
    std::vector<std::pair<Vec3, double>> one, two;
    for (int b = 0; b < 40; ++b) {
      one.push_back({{at(random), at(random), at(random)}, radius(random)});
      two.push_back({{at(random) + 50, at(random), at(random)}, radius(random)});
    }
    std::size_t pairs = 0;
    double deepest = 0;
    for (const auto& [p, r] : one) {
      for (const auto& [q, s] : two) {
        const double depth = r + s - std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
        pairs += depth > 0;
        deepest = std::max(deepest, depth);
      }
    }
    const auto found = contact(balls(one, 60), balls(two, 60));
    EXPECT_EQ(found ? found->pairs : 0, pairs);
    if (found) {
      EXPECT_NEAR(found->depth_mm, deepest, 1e-12);
    }
  }
  const auto touch = contact(balls({{{0, 0, 0}, 3}}, 9), balls({{{4, 0, 0}, 2}}, 9));
  ASSERT_TRUE(touch.has_value());
  EXPECT_NEAR(touch->place[0], 2.5, 1e-12);
  EXPECT_FALSE(contact(balls({{{0, 0, 0}, 3}}, 9), balls({{{6, 0, 0}, 2}}, 9)).has_value());
}

TEST(Preview, SpheresStandOnTheLargestBallsAndFaceOutwards) {
  const BentCylinder body(-1e9);
  const BallSet set = posed(body, 40);
  const SurfaceMesh mesh = preview(set, 50);
  ASSERT_EQ(mesh.V.rows() % 42, 0);
  ASSERT_LE(mesh.V.rows(), 50 * 42);
  ASSERT_EQ(mesh.F.rows(), mesh.V.rows() / 42 * 80);
  double volume = 0;
  for (Eigen::Index t = 0; t < mesh.F.rows(); ++t) {
    volume += mesh.V.row(mesh.F(t, 0)).dot(mesh.V.row(mesh.F(t, 1)).cross(mesh.V.row(mesh.F(t, 2)))) / 6;
  }
  EXPECT_GT(volume, 0.5 * static_cast<double>(covered_voxels(set, grown_box(set))));
  EXPECT_EQ(preview(balls({{{4, 4, 4}, 3}}, 9)).V.rows(), 42);
}

TEST(Tears, ASoundBodyHasNoneAndSeededOnesAreFound) {
  const BentCylinder body(0.3);
  const BallSet rest = posed(body, 0);
  const TearDetector detector(rest, body.skeleton.segment);
  // Two deep, by trying every voxel.
  const Image held = covered(rest, grown_box(rest));
  const ImageGrid& grid = held.grid;
  const auto at = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < grid.size[0] && j < grid.size[1] && k < grid.size[2] &&
           held.scalars<std::uint8_t>()[grid.offset(i, j, k)] != 0;
  };
  std::size_t deep = 0;
  test::for_voxels({{0, 0, 0}, grid.size}, [&](int i, int j, int k) {
    bool all = at(i, j, k);
    for (int d = -2; d <= 2; ++d) all = all && at(i + d, j, k) && at(i, j + d, k) && at(i, j, k + d);
    deep += all;
  });
  EXPECT_EQ(detector.deep_voxels(), deep);
  EXPECT_GT(deep, 500U);
  EXPECT_GT(detector.deep_links(), 20U);
  EXPECT_FALSE(detector.look(rest).errs());
  for (const double degrees : {10.0, 30.0}) EXPECT_FALSE(detector.look(posed(body, degrees)).errs());

  // The upper half is drawn away, by more and more, somewhere.
  std::mt19937 random(11);
  std::uniform_real_distribution<double> way(-1, 1), gap(16, 24), angle(0, 30);
  std::size_t found = 0;
  for (int seed = 0; seed < 40; ++seed) {
    BallSet set = posed(body, angle(random));
    const Vec3 shift{3 * way(random), 3 * way(random), gap(random)};
    for (Ball& ball : set.balls) {
      if (ball.motion != 1) continue;
      for (std::size_t a = 0; a < 3; ++a) ball.centre[a] += shift[a];
    }
    found += detector.look(set).errs();
  }
  EXPECT_GE(found, 38U);

  // Flesh that is gone.
  BallSet hole = rest;
  for (Ball& ball : hole.balls) {
    if (std::abs(ball.centre[2] - 15) < 10) ball.radius2 = 0;
  }
  EXPECT_GT(detector.look(hole).uncovered, 0U);
}

}  // namespace
}  // namespace ecorche::runtime
