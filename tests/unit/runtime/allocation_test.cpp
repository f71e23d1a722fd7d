// SPDX-License-Identifier: Apache-2.0
// Nothing is allocated in a frame: counted over the whole process, which is why this is a test of its own.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <memory>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "tests/support/counted_new.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

TEST(Allocation, NoneInAFrame) {
  const BodyPoser poser(std::make_shared<const Model>(test::toy_model()));
  PosedBody body = poser.make_frame({.positions = true, .quantised = true, .normals = true});
  Pose pose = Pose::rest(3);
  for (const NodesOf nodes : {NodesOf::body, NodesOf::tissues}) {
    for (const Skinning skinning : {Skinning::lbs, Skinning::dqs, Skinning::cor}) {
      tbb::task_arena(1).execute([&] {
        ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body, nodes).ok());  // whatever is lazy
        const std::size_t before = test::allocated;
        for (int frame = 1; frame <= 20; ++frame) {
          pose.rotation[1] =
              Eigen::AngleAxisd(0.15 * frame, Eigen::Vector3d::UnitX());  // beyond its limit, too
          ASSERT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body, nodes).ok());
        }
        EXPECT_EQ(test::allocated - before, 0u) << skinning_name(skinning);
      });
    }
  }
  EXPECT_GT(test::allocated, 0u) << "the counter counts";
}

TEST(Allocation, NoneInAVolume) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  const BodyPoser poser(model);
  const VolumePoser volumes(model);
  PosedBody body = poser.make_frame();
  VolumePoser::Scratch scratch;
  PosedVolume kept;
  Image whole;
  ImageGrid grid = model->volumes[0].image.grid;
  for (auto& size : grid.size) size += 40;
  Pose pose = Pose::rest(3);
  tbb::task_arena(1).execute([&] {
    std::size_t before = 0;
    for (int frame = 0; frame <= 20; ++frame) {
      if (frame == 2) before = test::allocated;
      pose.rotation[1] = Eigen::AngleAxisd(0.1 * frame, Eigen::Vector3d::UnitX());
      ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
      volumes.pose(body.nodes, model->volumes[0], Sampling::trilinear, grid, whole, scratch);
      volumes.follow(body.nodes, model->volumes[0], Sampling::nearest, grid, kept, scratch);
    }
    EXPECT_EQ(test::allocated - before, 0u);
  });
}

TEST(Allocation, NoneInAProbe) {
  const auto model = std::make_shared<const Model>(test::toy_model());
  const BodyPoser poser(model);
  const Probe probe(model);
  PosedBody body = poser.make_frame();
  Probe::PosedTree tree;
  Probed out;
  const ProbeOptions wants{.gradient = true, .tissue = true, .volumes = {{0}, {1}}};
  constexpr int numbers = 3 * 500;
  std::vector<float> points;
  points.reserve(numbers);
  for (int i = 0; i < numbers; ++i)
    points.push_back(static_cast<float>(i * 37 % 300) - (i % 3 == 2 ? 0.0F : 150.0F));
  Pose pose = Pose::rest(3);
  tbb::task_arena(1).execute([&] {
    std::size_t before = 0;
    for (int frame = 0; frame <= 10; ++frame) {
      if (frame == 2) before = test::allocated;
      pose.rotation[1] = Eigen::AngleAxisd(0.1 * frame, Eigen::Vector3d::UnitX());
      ASSERT_TRUE(poser.run(pose, Skinning::cor, {}, body).ok());
      probe.follow(body.nodes, tree);
      probe.posed_to_rest(tree, points, wants, out);
      probe.rest_to_posed(tree, points, wants, out);
    }
    EXPECT_EQ(test::allocated - before, 0u);
  });
}

}  // namespace
}  // namespace ecorche::runtime
