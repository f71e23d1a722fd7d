// SPDX-License-Identifier: Apache-2.0
// Posed volumes of which only the moved bricks are made again, against volumes made whole.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <memory>
#include <random>
#include <stop_token>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "runtime/volume/draw_tets.hpp"
#include "tests/support/instruction_sets.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

class BricksTest : public testing::Test {
 protected:
  BricksTest()
      : model(std::make_shared<const Model>(test::toy_model())),
        body_poser(model),
        body(body_poser.make_frame()),
        poser(model) {
    // Turned, so that a tet's box is wider than it; about 100 bricks, most of them cut short nowhere.
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction =
        Eigen::Quaterniond(0.9, 0.2, -0.3, 0.1).normalized().toRotationMatrix();
    std::copy_n(direction.data(), 9, grid.direction.begin());
    grid.spacing = {3, 3.5, 4};
    const Vector3d low = direction * Vector3d(-120, -120, -60);
    grid.origin = {low.x(), low.y(), low.z()};
    grid.size = {110, 100, 97};
    noise.image = Image(ImageGrid{{40, 40, 70}, {-100, -100, -20}, {5, 5, 5}}, ScalarType::u8);
    std::mt19937 random(9);
    for (std::byte& value : noise.image.bytes) value = static_cast<std::byte>(random() % 255);
    noise.background = 255;
  }

  std::span<const float> bend(double flexion, double twist) {
    Pose pose = Pose::rest(3);
    pose.rotation[1] = Eigen::AngleAxisd(flexion, Vector3d::UnitX());
    pose.rotation[2] = Eigen::AngleAxisd(twist, Vector3d::UnitZ());
    EXPECT_TRUE(body_poser.run(pose, Skinning::cor, {}, body).ok());
    return body.nodes;
  }

  // Beyond the joints' limits: half of the beam through the other half, and inverted tets between.
  std::vector<float> folded(double flexion) const {
    std::vector<float> nodes(model->nodes.data(), model->nodes.data() + model->nodes.size());
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(flexion, Vector3d::UnitX()).toRotationMatrix();
    for (std::size_t n = 0; n < nodes.size(); n += 3) {
      if (nodes[n + 2] <= 150) continue;
      const Vector3d at(static_cast<double>(nodes[n]), static_cast<double>(nodes[n + 1]),
                        static_cast<double>(nodes[n + 2]) - 150);
      const Eigen::Vector3f moved = (turn * at + Vector3d(0, 0, 150)).cast<float>();
      std::copy_n(moved.data(), 3, &nodes[n]);
    }
    return nodes;
  }

  // Follows the pose; the share of bricks that were made again.
  double follow(std::span<const float> nodes, Sampling sampling) {
    poser.follow(nodes, noise, sampling, grid, kept, scratch);
    poser.pose(nodes, noise, sampling, grid, slow, slow_scratch);
    EXPECT_EQ(kept.image.bytes, slow.bytes);
    for (std::uint32_t b = 0, i = 0; b < kept.bricks.all(); ++b) {
      const bool listed = i < kept.rewritten.size() && kept.rewritten[i] == b;
      EXPECT_EQ(listed, kept.moved[b] != 0);
      i += listed ? 1 : 0;
    }
    return static_cast<double>(kept.rewritten.size()) / static_cast<double>(kept.bricks.all());
  }

  std::shared_ptr<const Model> model;
  BodyPoser body_poser;
  PosedBody body;
  VolumePoser poser;
  VolumePoser::Scratch scratch, slow_scratch;
  ImageGrid grid;
  ModelVolume noise;
  PosedVolume kept;
  Image slow;
};

TEST_F(BricksTest, TheSameBytesAsAWholeVolumeOnEveryInstructionSet) {
  test::for_instruction_sets([&] {
    for (const Sampling sampling : {Sampling::nearest, Sampling::trilinear}) {
      kept = {};
      EXPECT_EQ(follow(bend(0.3, 0), sampling), 1) << "the first is whole";
      EXPECT_EQ(follow(bend(0.3, 0), sampling), 0) << "nothing moved";
      const double tip = follow(bend(0.3, 0.4), sampling);
      EXPECT_GT(tip, 0);
      EXPECT_LT(tip, 0.5) << "the tip alone twists";
      for (const double flexion : {0.5, 1.2}) {
        const double share = follow(bend(flexion, 0.4), sampling);
        EXPECT_GT(share, 0);
        EXPECT_LT(share, 0.9);
      }
      for (const double flexion : {2.5, 2.8}) EXPECT_GT(follow(folded(flexion), sampling), 0);
      follow(bend(0, 0), sampling);
    }
  });
}

TEST_F(BricksTest, OneNodeMovesTheBricksOfItsTets) {
  std::vector<float> nodes(model->nodes.data(), model->nodes.data() + model->nodes.size());
  grid.direction = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  grid.spacing = {1, 1, 1};
  grid.origin = {-48, -48, -20};
  grid.size = {96, 96, 340};
  follow(nodes, Sampling::nearest);
  const std::size_t node = model->node_count() / 2;
  nodes[3 * node] += 0.75F;
  follow(nodes, Sampling::nearest);
  EXPECT_GT(kept.rewritten.size(), 0U);
  for (const std::uint32_t b : kept.rewritten) {
    bool near = false;
    const VoxelRange box = kept.bricks.voxels(b, grid);
    for (Eigen::Index t = 0; t < model->tets.rows(); ++t) {
      bool of_node = false, inside = true;
      for (int c = 0; c < 4; ++c) of_node = of_node || model->tets(t, c) == static_cast<int>(node);
      for (std::size_t a = 0; a < 3 && of_node; ++a) {
        double low = 1e9, high = -1e9;
        for (int c = 0; c < 4; ++c) {
          const auto x = static_cast<double>(nodes[3 * static_cast<std::size_t>(model->tets(t, c)) + a]);
          low = std::min(low, x - 1 - grid.origin[a]);
          high = std::max(high, x + 1 - grid.origin[a]);
        }
        inside = inside && low <= box.last[a] && high >= box.first[a];
      }
      near = near || (of_node && inside);
    }
    EXPECT_TRUE(near) << "brick " << b << " was made again for nothing";
  }
  // An inverted tet and a sheet too flat for float32 take other ways.
  nodes[3 * node] += 60;
  follow(nodes, Sampling::nearest);
  for (std::size_t n = 0; n < nodes.size() / 6; ++n) nodes[3 * n] = 1e-4F * static_cast<float>(n % 3);
  follow(nodes, Sampling::trilinear);
  nodes[3] += 0.5F;
  EXPECT_LT(follow(nodes, Sampling::trilinear), 0.5);
}

TEST_F(BricksTest, AnythingElseThanAPoseMakesAllBricksAgain) {
  const auto nodes = bend(0.7, 0);
  follow(nodes, Sampling::nearest);
  EXPECT_EQ(follow(nodes, Sampling::trilinear), 1) << "other sampling";
  grid.size[1] -= 5;
  EXPECT_EQ(follow(nodes, Sampling::trilinear), 1) << "another grid";
  grid.origin[0] += 1e-3;
  EXPECT_EQ(follow(nodes, Sampling::trilinear), 1) << "a moved grid";
  const ModelVolume& other = model->volumes[0];
  poser.follow(nodes, other, Sampling::trilinear, grid, kept, scratch);
  EXPECT_EQ(kept.rewritten.size(), kept.bricks.all()) << "another volume";
  EXPECT_EQ(kept.image.type, other.image.type);
  EXPECT_EQ(follow(nodes, Sampling::trilinear), 1);
  EXPECT_EQ(follow(nodes, Sampling::trilinear), 0);
  std::stop_source stop;
  stop.request_stop();
  Context stopped;
  stopped.stop = stop.get_token();
  EXPECT_THROW(poser.follow(bend(0.9, 0), noise, Sampling::trilinear, grid, kept, scratch, stopped), Error);
  EXPECT_EQ(follow(bend(0.9, 0), Sampling::trilinear), 1) << "half of it may have been drawn";
}

TEST_F(BricksTest, SameBytesForAnyNumberOfThreads) {
  bend(0.7, 0);
  const std::vector<float> first = body.nodes;
  bend(0.8, 0.2);
  const std::vector<float> second = body.nodes;
  PosedVolume four;
  VolumePoser::Scratch other;
  const auto both = [&](PosedVolume& to, VolumePoser::Scratch& with) {
    poser.follow(first, noise, Sampling::trilinear, grid, to, with);
    poser.follow(second, noise, Sampling::trilinear, grid, to, with);
  };
  tbb::task_arena(1).execute([&] { both(kept, scratch); });
  tbb::task_arena(4).execute([&] { both(four, other); });
  EXPECT_EQ(kept.image.bytes, four.image.bytes);
  EXPECT_EQ(kept.rewritten, four.rewritten);
}

TEST(InvertedTets, AllLieInAFewBoxesAndNearOnesShareOne) {
  std::mt19937 random(7);
  const auto box = [&](std::int32_t spread) {
    VoxelRange out;
    for (std::size_t a = 0; a < 3; ++a) {
      out.first[a] = static_cast<std::int32_t>(random()) % spread;
      out.last[a] = out.first[a] + static_cast<std::int32_t>(random() % 4U);
    }
    return out;
  };
  for (const std::int32_t spread : {2, 50, 5000}) {
    Inverted inverted;
    std::vector<VoxelRange> added;
    for (int i = 0; i < 100; ++i) {
      added.push_back(box(spread));
      inverted.add(added.back());
    }
    if (spread == 2) {
      EXPECT_LT(inverted.count, Inverted::most);
    } else {
      EXPECT_EQ(inverted.count, Inverted::most);
    }
    for (const VoxelRange& one : added) {
      bool held = false;
      for (std::size_t b = 0; b < inverted.count; ++b) {
        const VoxelRange around = inverted.box[b].around(one);
        held = held || (around.first == inverted.box[b].first && around.last == inverted.box[b].last);
      }
      EXPECT_TRUE(held);
    }
  }
}

}  // namespace
}  // namespace ecorche::runtime
