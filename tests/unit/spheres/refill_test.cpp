// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/refill.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <queue>
#include <random>

#include "tests/unit/io/scratch.hpp"
#include "tests/unit/spheres/bent_cylinder.hpp"
#include "tests/unit/spheres/exhaustive.hpp"

namespace ecorche::runtime {
namespace {

using test::BentCylinder;
using test::for_voxels;

constexpr double kEverything = -1e9;  // thinness that keeps every voxel

BallSet posed(const VolumetricSkeleton& skeleton, std::span<const RigidTransform> motions) {
  BallSet set = balls_at_rest(skeleton, skeleton.grid);
  move_balls(skeleton, motions, set);
  return set;
}

// Owners of every voxel of the box.
std::vector<std::int32_t> owners(const BallSet& set, const LatticeBox& box) {
  std::vector<std::int32_t> out(static_cast<std::size_t>(box.size[0]) *
                                    static_cast<std::size_t>(box.size[1]) *
                                    static_cast<std::size_t>(box.size[2]),
                                TileOwners::none);
  const ImageGrid grid = grid_of(set.lattice, box);
  for_tiles(set, box, {}, [&](const Tile& tile) {
    tile.for_owned([&](int i, int j, int k, std::int32_t owner) { out[grid.offset(i, j, k)] = owner; });
  });
  return out;
}

BallSet random_balls(int seed, int count, double radius, double spread) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::uniform_real_distribution<double> at(-spread / 4, spread), size(0, radius * radius);
  std::uniform_int_distribution<int> kind(0, 3);
  BallSet set;
  set.lattice.size = {static_cast<int>(spread), static_cast<int>(spread), static_cast<int>(spread)};
  set.back = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int b = 0; b < count; ++b) {
    Vec3 centre{at(random), at(random), at(random)};
    // Whole and half places, whose distances tie; and balls of no size.
    if (kind(random) == 0) {
      for (double& x : centre) x = std::floor(2 * x) / 2;
    }
    const double radius2 = kind(random) == 0 ? std::floor(size(random)) : size(random);
    set.balls.push_back({centre, centre, radius2, radius2, 0});
  }
  return set;
}

TEST(Refill, OwnersAreThoseOfTheExhaustiveSearch) {
  for (const auto& [count, radius, spread] :
       {std::tuple{1, 20.0, 25.0}, {7, 9.0, 30.0}, {300, 6.0, 30.0}, {300, 15.0, 20.0}}) {
    const BallSet set = random_balls(count, count, radius, spread);
    const LatticeBox box = grown_box(set);
    const std::vector<std::int32_t> found = owners(set, box);
    std::size_t at = 0, owned = 0, wrong = 0;
    for_voxels(box, [&](int i, int j, int k) {
      const std::int32_t expected = test::owner_of(set, i, j, k);
      wrong += found[at++] != expected;
      owned += expected >= 0;
    });
    EXPECT_EQ(wrong, 0U) << count << " balls";
    EXPECT_GT(owned, 100U);
  }
}

TEST(Refill, TheLowerRowOwnsWhatIsAsNear) {
  BallSet set = random_balls(1, 0, 1, 8);
  for (const double x : {6.0, 2.0, 6.0}) set.balls.push_back({{x, 4, 4}, {x, 4, 4}, 16, 16, 0});
  const std::vector<std::int32_t> found = owners(set, {{0, 0, 0}, {8, 8, 8}});
  EXPECT_EQ(found[set.lattice.offset(4, 4, 4)], 0);  // two of the three are as near: row 0 and row 1
  EXPECT_EQ(found[set.lattice.offset(6, 4, 4)], 0);  // rows 0 and 2 share their centre
  EXPECT_EQ(found[set.lattice.offset(3, 4, 4)], 1);
}

TEST(Refill, WhatABallTouchesOnlyIsNotItsOwn) {
  BallSet set = random_balls(1, 0, 1, 8);
  set.balls.push_back({{3, 3, 3}, {3, 3, 3}, 4, 4, 0});
  const std::vector<std::int32_t> found = owners(set, {{0, 0, 0}, {8, 8, 8}});
  EXPECT_EQ(found[set.lattice.offset(4, 4, 4)], 0);
  EXPECT_EQ(found[set.lattice.offset(5, 3, 3)], TileOwners::none);
}

// Values that no two neighbours share.
Image textured(const Image& mask, int components) {
  Image out(mask.grid, ScalarType::i16, components);
  const auto values = out.scalars<std::int16_t>();
  const auto inside = mask.scalars<std::uint8_t>();
  for (std::size_t v = 0; v < inside.size(); ++v) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(components); ++c) {
      values[v * static_cast<std::size_t>(components) + c] =
          inside[v] == 0 ? static_cast<std::int16_t>(-1000)
                         : static_cast<std::int16_t>((v * 2654435761U + c * 977U) % 3000);
    }
  }
  return out;
}

TEST(Refill, KeepingEveryVoxelRefillsTheObjectAtRest) {
  const BentCylinder body(kEverything);
  for (const int components : {1, 3}) {
    const Image volume = textured(body.volume, components);
    const BallSet set = posed(body.skeleton, body.bent(0));
    EXPECT_EQ(grown_box(set), (LatticeBox{{0, 0, 0}, body.volume.grid.size}));
    for (const Sampling sampling : {Sampling::nearest, Sampling::trilinear}) {
      EXPECT_TRUE(refill(set, grown_box(set), volume, -1000, sampling).bytes == volume.bytes);
    }
  }
}

TEST(Refill, ChamferBallsKeepWithinTheObject) {
  BentCylinder body(kEverything);
  body.skeleton.metric = DistanceMetric::chamfer345;
  // By its definition: the least sum of steps of 3, 4 and 5 to a background voxel.
  const auto mask = body.volume.scalars<std::uint8_t>();
  const ImageGrid& grid = body.volume.grid;
  for (std::size_t v = 0; v < body.skeleton.size(); ++v) {
    const auto& p = body.skeleton.voxel[v];
    std::uint32_t least = 1U << 30;
    for_voxels({{0, 0, 0}, grid.size}, [&](int i, int j, int k) {
      if (mask[grid.offset(i, j, k)] != 0) return;
      std::array<int, 3> d{std::abs(i - p[0]), std::abs(j - p[1]), std::abs(k - p[2])};
      std::sort(d.begin(), d.end());
      least = std::min(least, static_cast<std::uint32_t>(3 * d[2] + d[1] + d[0]));
    });
    body.skeleton.distance[v] = least;
  }
  const BallSet set = balls_at_rest(body.skeleton, grid);
  EXPECT_EQ(refill(set, grown_box(set), body.volume, 0, Sampling::nearest).bytes, body.volume.bytes);
}

// Where a posed voxel was at rest: the way back of the segment of the ball that owns it, in space.
std::size_t rest_voxel(const BentCylinder& body, const std::vector<RigidTransform>& motions,
                       std::int32_t owner, int i, int j, int k) {
  const auto p = body.volume.grid.point(i, j, k);
  const auto segment = static_cast<std::size_t>(body.skeleton.segment[static_cast<std::size_t>(owner)]);
  const Eigen::Vector3d rest = motions[segment].inverse() * Eigen::Vector3d(p[0], p[1], p[2]);
  const auto q = body.volume.grid.index({rest.x(), rest.y(), rest.z()});
  return body.volume.grid.offset(static_cast<int>(std::lround(q[0])), static_cast<int>(std::lround(q[1])),
                                 static_cast<int>(std::lround(q[2])));
}

TEST(Refill, EveryVoxelShowsTheRestPlaceOfItsOwner) {
  const BentCylinder body(0.4);
  const Image volume = textured(body.volume, 1);
  const auto motions = body.bent(50);
  const BallSet set = posed(body.skeleton, motions);
  const LatticeBox box = grown_box(set);
  const Image image = refill(set, box, volume, -1000, Sampling::nearest);
  std::size_t at = 0, wrong = 0, held = 0;
  for_voxels(box, [&](int i, int j, int k) {
    std::int16_t expected = -1000;
    const std::int32_t owner = test::owner_of(set, i, j, k);
    if (owner >= 0) {
      ++held;
      expected = volume.scalars<std::int16_t>()[rest_voxel(body, motions, owner, i, j, k)];
    }
    wrong += image.scalars<std::int16_t>()[at++] != expected;
  });
  EXPECT_GT(held, 3000U);
  EXPECT_EQ(wrong, 0U);
}

// Between voxels, too: a volume that is linear in space comes back exactly so.
TEST(Refill, TrilinearValuesAreThoseOfTheRestPlace) {
  const BentCylinder body(0.4);
  Image volume(body.volume.grid, ScalarType::f32);
  const auto ramp = [](double i, double j, double k) { return 3 * i - 5 * j + 2 * k; };
  for_voxels({{0, 0, 0}, volume.grid.size}, [&](int i, int j, int k) {
    volume.scalars<float>()[volume.grid.offset(i, j, k)] = static_cast<float>(ramp(i, j, k));
  });
  const BallSet set = posed(body.skeleton, body.bent(50));
  const LatticeBox box = grown_box(set);
  const Image image = refill(set, box, volume, -1000, Sampling::trilinear);
  std::size_t at = 0, held = 0;
  double worst = 0;
  for_voxels(box, [&](int i, int j, int k) {
    const float shown = image.scalars<float>()[at++];
    const std::int32_t owner = test::owner_of(set, i, j, k);
    if (owner < 0) return;
    const Ball& ball = set.balls[static_cast<std::size_t>(owner)];
    const auto& r = set.back[static_cast<std::size_t>(ball.motion)];
    const Vec3 q{i - ball.centre[0], j - ball.centre[1], k - ball.centre[2]};
    Vec3 place;
    for (std::size_t a = 0; a < 3; ++a)
      place[a] = ball.rest[a] + r[3 * a] * q[0] + r[3 * a + 1] * q[1] + r[3 * a + 2] * q[2];
    for (std::size_t a = 0; a < 3; ++a) {
      if (place[a] < 0 || place[a] > volume.grid.size[a] - 1) return;
    }
    ++held;
    worst = std::max(worst, std::abs(shown - ramp(place[0], place[1], place[2])));
  });
  EXPECT_GT(held, 3000U);
  EXPECT_LT(worst, 1e-3);
}

// Size of the largest 6-connected part of `value`, and of all of it.
std::pair<std::size_t, std::size_t> largest_part(const Image& image, std::uint8_t value) {
  const ImageGrid& grid = image.grid;
  const auto voxels = image.scalars<std::uint8_t>();
  std::vector<bool> seen(voxels.size());
  std::size_t largest = 0, all = 0;
  for_voxels({{0, 0, 0}, grid.size}, [&](int i, int j, int k) {
    std::size_t part = 0;
    std::queue<std::array<int, 3>> open;
    const auto visit = [&](int x, int y, int z) {
      if (x < 0 || y < 0 || z < 0 || x >= grid.size[0] || y >= grid.size[1] || z >= grid.size[2]) return;
      const std::size_t v = grid.offset(x, y, z);
      if (seen[v] || voxels[v] != value) return;
      seen[v] = true;
      ++part;
      open.push({x, y, z});
    };
    visit(i, j, k);
    while (!open.empty()) {
      const auto [x, y, z] = open.front();
      open.pop();
      visit(x - 1, y, z), visit(x + 1, y, z), visit(x, y - 1, z), visit(x, y + 1, z), visit(x, y, z - 1),
          visit(x, y, z + 1);
    }
    largest = std::max(largest, part);
    all += part;
  });
  return {largest, all};
}

// Figure 6: values of the two halves must not interleave where they meet.
TEST(Refill, TheBarInABentCylinderStaysWhole) {
  const BentCylinder body(0.2);
  const auto motions = body.bent(70);
  const BallSet set = posed(body.skeleton, motions);
  const LatticeBox box = grown_box(set);
  const Image whole = refill(set, box, body.volume, 0, Sampling::nearest);
  const auto [largest, all] = largest_part(whole, 2);
  const auto [rest, rest_all] = largest_part(body.volume, 2);
  EXPECT_EQ(rest, rest_all);
  // A voxel of a turned bar may touch it by an edge only.
  EXPECT_GE(static_cast<double>(largest), 0.99 * static_cast<double>(all));
  EXPECT_NEAR(static_cast<double>(all), static_cast<double>(rest), 0.12 * static_cast<double>(rest));

  // Without the proximity buffer balls of one half draw their flesh over the bar of the other.
  Image torn(whole.grid, ScalarType::u8);
  std::size_t at = 0;
  for_voxels(box, [&](int i, int j, int k) {
    const std::int32_t owner = test::owner_of(set, i, j, k, test::Who::last);
    std::uint8_t& voxel = torn.scalars<std::uint8_t>()[at++];
    if (owner < 0) return;
    voxel = body.volume.scalars<std::uint8_t>()[rest_voxel(body, motions, owner, i, j, k)];
  });
  const auto [torn_largest, torn_all] = largest_part(torn, 2);
  EXPECT_LT(static_cast<double>(torn_largest), 0.95 * static_cast<double>(largest));
}

TEST(Refill, ABoxIsThatPartOfTheWholeWhateverTheThreads) {
  const BentCylinder body(0.3);
  const Image volume = textured(body.volume, 1);
  const BallSet set = posed(body.skeleton, body.bent(37));
  const LatticeBox box = grown_box(set);
  Image one, two;
  tbb::task_arena(1).execute([&] { one = refill(set, box, volume, -1000, Sampling::trilinear); });
  tbb::task_arena(4).execute([&] { two = refill(set, box, volume, -1000, Sampling::trilinear); });
  EXPECT_EQ(one.bytes, two.bytes);

  const LatticeBox part{{3, -5, 17}, {14, 40, 31}};
  const Image cut = refill(set, part, volume, -1000, Sampling::trilinear);
  std::size_t at = 0, wrong = 0;
  for_voxels(part, [&](int i, int j, int k) {
    std::int16_t expected = -1000;
    const std::array<int, 3> in{i - box.first[0], j - box.first[1], k - box.first[2]};
    if (in[0] >= 0 && in[1] >= 0 && in[2] >= 0 && in[0] < box.size[0] && in[1] < box.size[1] &&
        in[2] < box.size[2])
      expected = one.scalars<std::int16_t>()[one.grid.offset(in[0], in[1], in[2])];
    wrong += cut.scalars<std::int16_t>()[at++] != expected;
  });
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(cut.grid.point(0, 0, 0), set.lattice.point(3, -5, 17));
}

TEST(Refill, BoxesInSpaceHoldTheVoxelsBetweenTheirEnds) {
  const BentCylinder body(0.3);
  const ImageGrid& grid = body.volume.grid;
  EXPECT_EQ(box_within(grid, grid.point(2, 3, 4), grid.point(5, 3, 9)), (LatticeBox{{2, 3, 4}, {4, 1, 6}}));
  EXPECT_EQ(box_within(grid, grid.point(-1.5, 3, 4), grid.point(5.5, 3, 9)),
            (LatticeBox{{-1, 3, 4}, {7, 1, 6}}));
  EXPECT_EQ(box_within(grid, grid.point(2.2, 3, 4), grid.point(2.8, 3, 9)).size[0], 0);
}

TEST(Refill, RefusesWhatCannotBeRefilled) {
  BentCylinder body(0.3);
  BallSet set = balls_at_rest(body.skeleton, body.skeleton.grid);
  set.balls[1].radius2 = 5e6;
  EXPECT_THROW(grown_box(set), Error);
  Image small(body.skeleton.grid, ScalarType::i16);
  expect_error(ErrorKind::internal, "refill: the result is no image of the box (this is a bug)", [&] {
    refill_into(set, {{0, 0, 0}, {8, 8, 8}}, body.volume, 0, Sampling::nearest, small);
  });
  EXPECT_THROW(for_tiles(set, {{0, 0, 0}, {8, 8, 8}}, {}, [](const Tile&) {}), Error);
  set.balls[1] = set.balls[0];
  for (std::size_t a = 0; a < 3; ++a) set.balls[1].centre[a] = 5000;
  expect_error(ErrorKind::data, "the posed body needs more than 2^31 voxels (use a region, coarser voxels,",
               [&] { grown_box(set); });
  set.balls[1] = set.balls[0];
  set.balls[1].centre[2] = std::nan("");
  EXPECT_THROW(grown_box(set), Error);
  EXPECT_THROW(move_balls(body.skeleton, std::vector<RigidTransform>(1), set), Error);
  body.skeleton.segment[5] = VolumetricSkeleton::none;
  EXPECT_THROW(move_balls(body.skeleton, body.bent(1), set), Error);
  body.skeleton.segment.clear();
  EXPECT_THROW(move_balls(body.skeleton, body.bent(1), set), Error);
  body.skeleton.grid.spacing[1] = 2;
  EXPECT_THROW(balls_at_rest(body.skeleton, body.skeleton.grid), Error);
}

}  // namespace
}  // namespace ecorche::runtime
