// SPDX-License-Identifier: Apache-2.0
// Planes without the volume, and volumes of which only what moved is made again: both against whole
// refilling.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/refilled_volume.hpp"
#include "runtime/spheres/slice.hpp"
#include "tests/unit/spheres/exhaustive.hpp"

namespace ecorche::runtime {
namespace {

constexpr int kEdge = 80;

// Balls of three segments in the cube, some of them with ties and some of no size, and a noisy volume.
struct Body {
  ModelVolume volume;
  BallSet set;

  Body() {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> at(0, kEdge), size(0, 200);
    set.lattice.size = {kEdge, kEdge, kEdge};
    set.lattice.origin = {-3, 12, 400};
    set.lattice.spacing = {1.5, 1.5, 1.5};
    set.back.assign(3, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    for (int b = 0; b < 150; ++b) {
      Vec3 centre{at(random), at(random), at(random)};
      if (b % 3 == 0) {
        for (double& x : centre) x = std::floor(2 * x) / 2;
      }
      const double radius2 = b % 20 == 0 ? 0 : size(random);
      set.balls.push_back({centre, centre, radius2, radius2, centre[2] < 30 ? 0 : centre[2] < 55 ? 1 : 2});
    }
    volume.image = Image(set.lattice, ScalarType::i16, 2);
    for (std::int16_t& value : volume.image.scalars<std::int16_t>())
      value = static_cast<std::int16_t>(random() % 5000U);
    volume.background = -9;
  }

  // Every ball of the segment shifted and turned about z.
  void turn(std::int32_t segment, double angle, double shift) {
    const double c = std::cos(angle), s = std::sin(angle);
    set.back[static_cast<std::size_t>(segment)] = {c, s, 0, -s, c, 0, 0, 0, 1};
    for (Ball& ball : set.balls) {
      if (ball.motion != segment) continue;
      const double x = ball.rest[0] - 40, y = ball.rest[1] - 40;
      ball.centre = {40 + c * x - s * y + shift, 40 + s * x + c * y, ball.rest[2]};
    }
  }

  Image whole(const LatticeBox& box, Sampling sampling) const {
    return refill(set, box, volume.image, volume.background, sampling);
  }
};

const LatticeBox kBox{{-5, -3, 2}, {90, 86, 75}};

TEST(Follow, IsRefillingWhateverMoved) {
  Body body;
  RefilledVolume kept;
  follow(body.set, kBox, body.volume, Sampling::trilinear, kept);
  EXPECT_EQ(kept.moved, std::vector<std::uint8_t>(kept.bricks.all(), 1));
  ASSERT_EQ(kept.bricks.all(), 27U);
  struct Move {
    std::int32_t segment;
    double angle, shift;
  };
  std::size_t again = 0;
  // The last two: a turn about an axis that one ball does not leave, and nothing at all.
  for (const Move& move :
       {Move{2, 0.1, 0}, {2, 0.1, 0.5}, {0, -0.2, 0}, {1, 0.3, 1}, {1, 0.31, 1}, {1, 0.31, 1}}) {
    const Image before = kept.image;
    body.turn(move.segment, move.angle, move.shift);
    follow(body.set, kBox, body.volume, Sampling::trilinear, kept);
    EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::trilinear).bytes);
    again = static_cast<std::size_t>(std::count(kept.moved.begin(), kept.moved.end(), 1));
    EXPECT_LT(again, kept.bricks.all());
    for (std::size_t b = 0; b < kept.bricks.all(); ++b) {
      if (kept.moved[b] != 0) continue;
      const VoxelRange range = kept.bricks.voxels(b, kept.image.grid);
      const std::size_t at = kept.image.grid.offset(range.first[0], range.first[1], range.first[2]);
      EXPECT_EQ(kept.image.scalars<std::int16_t>()[2 * at], before.scalars<std::int16_t>()[2 * at]);
    }
  }
  EXPECT_EQ(again, 0U);
}

TEST(Follow, BallsThatComeAndGoShowWhereTheyWere) {
  Body body;
  RefilledVolume kept;
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  const std::size_t own = body.set.balls.size();
  // As bridges do: other rows, most of them the same balls.
  std::vector<Ball> bridges;
  for (int b = 0; b < 8; ++b) {
    const Vec3 at{10.0 + 8 * b, 20, 20};
    bridges.push_back({at, at, 30, 30, 0});
  }
  for (const int gone : {0, 3, 7}) {
    body.set.balls.resize(own);
    for (int b = 0; b < 8; ++b) {
      if (b != gone) body.set.balls.push_back(bridges[static_cast<std::size_t>(b)]);
    }
    follow(body.set, kBox, body.volume, Sampling::nearest, kept);
    EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::nearest).bytes) << gone;
    EXPECT_LE(std::count(kept.moved.begin(), kept.moved.end(), 1), gone == 0 ? 12 : 8) << gone;
  }
  // One alone, where nothing else is, goes and leaves nothing.
  body.set.balls.resize(own);
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  Vec3 corner{1, 1, 10};
  while (test::owner_of(body.set, static_cast<int>(corner[0]), 1, 10) >= 0) ++corner[0];
  ASSERT_LT(corner[0], kEdge);
  for (const bool there : {true, false}) {
    body.set.balls.resize(own);
    if (there) body.set.balls.push_back({corner, corner, 2, 2, 0});
    const Image before = kept.image;
    follow(body.set, kBox, body.volume, Sampling::nearest, kept);
    EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::nearest).bytes) << there;
    EXPECT_NE(kept.image.bytes, before.bytes);
  }
  // A ball that turns in its place.
  body.set.back[0] = {0, 1, 0, -1, 0, 0, 0, 0, 1};
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::nearest).bytes);
  // Other boxes, sampling and volumes are made anew.
  const LatticeBox other{{1, -3, 2}, {90, 86, 75}};
  follow(body.set, other, body.volume, Sampling::nearest, kept);
  EXPECT_EQ(kept.image.bytes, body.whole(other, Sampling::nearest).bytes);
  EXPECT_EQ(kept.image.grid, grid_of(body.set.lattice, other));
  follow(body.set, other, body.volume, Sampling::trilinear, kept);
  EXPECT_EQ(kept.image.bytes, body.whole(other, Sampling::trilinear).bytes);
  const ModelVolume twin = body.volume;
  body.volume.image.bytes.assign(body.volume.image.bytes.size(), std::byte{1});
  follow(body.set, other, twin, Sampling::trilinear, kept);
  EXPECT_EQ(std::count(kept.moved.begin(), kept.moved.end(), 0), 0);
}

TEST(Follow, AfterAStopAllIsMadeAgain) {
  Body body;
  RefilledVolume kept;
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  body.turn(2, 0.4, 0);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(
      follow(body.set, kBox, body.volume, Sampling::nearest, kept, {nullptr, nullptr, stop.get_token()}),
      Error);
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::nearest).bytes);
  // Stopped in another box, where the image had been made anew.
  const LatticeBox other{{1, -3, 2}, {90, 86, 75}};
  EXPECT_THROW(
      follow(body.set, other, body.volume, Sampling::nearest, kept, {nullptr, nullptr, stop.get_token()}),
      Error);
  follow(body.set, kBox, body.volume, Sampling::nearest, kept);
  EXPECT_EQ(kept.image.bytes, body.whole(kBox, Sampling::nearest).bytes);
}

// Where pixels are voxels.
TEST(Slice, IsAPlaneOfTheRefilledVolume) {
  Body body;
  body.turn(1, 0.7, 2);
  body.set.bridges_from = 110;
  const Image whole = body.whole(kBox, Sampling::trilinear);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    std::array<int, 3> at{20, 31, 40};
    at[static_cast<std::size_t>(u)] = at[static_cast<std::size_t>(v)] = 0;
    const ImageGrid& box = whole.grid;
    ImageGrid plane = box;
    plane.size = {box.size[static_cast<std::size_t>(u)], box.size[static_cast<std::size_t>(v)], 1};
    plane.origin = box.point(at[0], at[1], at[2]);
    plane.direction = {};
    const auto set = [&](int row, int column, double x) {
      plane.direction[static_cast<std::size_t>(3 * row + column)] = x;
    };
    set(u, 0, 1), set(v, 1, 1), set(axis, 2, axis == 1 ? -1 : 1);
    Image slice(plane, ScalarType::i16, 2);
    refill_slice(body.set, body.volume.image, body.volume.background, Sampling::trilinear, slice);
    std::size_t wrong = 0, held = 0;
    for (int q = 0; q < plane.size[1]; ++q) {
      for (int p = 0; p < plane.size[0]; ++p) {
        std::array<int, 3> voxel = at;
        voxel[static_cast<std::size_t>(u)] = p, voxel[static_cast<std::size_t>(v)] = q;
        for (std::size_t c = 0; c < 2; ++c) {
          const auto shown = slice.scalars<std::int16_t>()[2 * plane.offset(p, q, 0) + c];
          wrong += shown != whole.scalars<std::int16_t>()[2 * box.offset(voxel[0], voxel[1], voxel[2]) + c];
          held += shown != -9;
        }
      }
    }
    EXPECT_EQ(wrong, 0U) << axis;
    EXPECT_GT(held, 1000U) << axis;
  }
}

// Anywhere: every pixel asks every ball.
TEST(Slice, ObliquePixelsAskTheNearestBall) {
  Body body;
  body.turn(0, 0.4, -1);
  body.turn(2, 2.4, 3);
  ImageGrid plane;
  plane.size = {133, 71, 1};
  plane.spacing = {0.9, 1.7, 1};
  const Eigen::Matrix3d frame =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) plane.direction[static_cast<std::size_t>(3 * r + c)] = frame(r, c);
  }
  const Vec3 middle = body.set.lattice.point(40, 40, 40);
  const Eigen::Vector3d corner = Eigen::Vector3d(middle.data()) - frame * Eigen::Vector3d(60, 60, 0);
  plane.origin = {corner.x(), corner.y(), corner.z()};
  Image slice(plane, ScalarType::i16, 2);
  refill_slice(body.set, body.volume.image, body.volume.background, Sampling::nearest, slice);
  std::size_t wrong = 0, held = 0;
  for (int j = 0; j < plane.size[1]; ++j) {
    for (int i = 0; i < plane.size[0]; ++i) {
      const Vec3 p = body.set.lattice.index(plane.point(i, j, 0));
      const Ball* owner = nullptr;
      double least = 0;
      bool tie = false;
      for (const Ball& ball : body.set.balls) {
        double far = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          const double d = p[a] - std::floor(16 * ball.centre[a] + 0.5) / 16;
          far += d * d;
        }
        tie = tie || std::abs(far - ball.radius2) < 0.01 || (owner && std::abs(far - least) < 1e-9);
        if (far >= ball.radius2 || (owner && far >= least)) continue;
        owner = &ball;
        least = far;
      }
      if (tie) continue;  // the rim is rounded to 1/256 square voxel
      std::array<std::int16_t, 2> expected{-9, -9};
      if (owner) {
        const auto& r = body.set.back[static_cast<std::size_t>(owner->motion)];
        std::array<int, 3> at{};
        for (std::size_t a = 0; a < 3; ++a) {
          double rest = owner->rest[a];
          for (std::size_t b = 0; b < 3; ++b) rest += r[3 * a + b] * (p[b] - owner->centre[b]);
          at[a] = static_cast<int>(std::floor(rest + 0.5));
        }
        if (std::all_of(at.begin(), at.end(), [](int x) { return x >= 0 && x < kEdge; })) {
          const std::size_t from = 2 * body.volume.image.grid.offset(at[0], at[1], at[2]);
          expected = {body.volume.image.scalars<std::int16_t>()[from],
                      body.volume.image.scalars<std::int16_t>()[from + 1]};
        }
        ++held;
      }
      const std::size_t at = 2 * plane.offset(i, j, 0);
      wrong += slice.scalars<std::int16_t>()[at] != expected[0] ||
               slice.scalars<std::int16_t>()[at + 1] != expected[1];
    }
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_GT(held, 3000U);
  Image threaded(plane, ScalarType::i16, 2);
  tbb::task_arena(1).execute([&] {
    refill_slice(body.set, body.volume.image, body.volume.background, Sampling::nearest, threaded);
  });
  EXPECT_EQ(threaded.bytes, slice.bytes);
}

TEST(Slice, RefusesWhatIsNoPlane) {
  Body body;
  Image thick(grid_of(body.set.lattice, {{0, 0, 0}, {4, 4, 2}}), ScalarType::i16, 2);
  EXPECT_THROW(refill_slice(body.set, body.volume.image, 0, Sampling::nearest, thick), Error);
  Image other(grid_of(body.set.lattice, {{0, 0, 0}, {4, 4, 1}}), ScalarType::u8, 2);
  EXPECT_THROW(refill_slice(body.set, body.volume.image, 0, Sampling::nearest, other), Error);
}

}  // namespace
}  // namespace ecorche::runtime
