// SPDX-License-Identifier: Apache-2.0
// What a whole pose needs beside its joints, found again at that pose and nowhere else.
#include "preprocess/correct/pose_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include <ecorche/runtime/body_poser.hpp>
#include "preprocess/correct/samples.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::test {
namespace {

std::vector<float> nodes_of(const Model& model, const Pose& pose) {
  const runtime::BodyPoser poser(std::make_shared<const Model>(model));
  runtime::PosedBody body = poser.make_frame();
  EXPECT_TRUE(
      poser.run(pose, runtime::Skinning::cor, {}, body, runtime::NodesOf::body, runtime::Root::still).ok());
  return body.nodes;
}

double farthest(const std::vector<float>& a, const std::vector<float>& b) {
  double out = 0;
  for (std::size_t i = 0; i < a.size(); ++i) out = std::max(out, static_cast<double>(std::abs(a[i] - b[i])));
  return out;
}

Pose bent(const Model& model, double hinge, double tip) {
  Pose pose = correct::turned(model.rig.skeleton, 1, {hinge, 0, 0});
  pose.rotation[2] = correct::turned(model.rig.skeleton, 2, {tip, 0, 0}).rotation[2];
  return pose;
}

// Free nodes between two heights pushed by some mm, as if flesh had settled there.
std::vector<float> pushed(const Model& model, std::vector<float> nodes, double low, double high) {
  std::vector<std::uint8_t> of_bone(model.node_count(), 0);
  for (std::size_t t = 0; t < model.tet_count(); ++t)
    for (Eigen::Index c = 0; c < 4 && model.tet_label[t] != TetMesh::soft; ++c)
      of_bone[static_cast<std::size_t>(model.tets(static_cast<Eigen::Index>(t), c))] = 1;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const float z = model.nodes(static_cast<Eigen::Index>(n), 2);
    if (of_bone[n] == 0 && z >= low && z <= high) nodes[3 * n] += 4 + static_cast<float>(n % 5);
  }
  return nodes;
}

class PosePlaces : public testing::Test {
 protected:
  Model model_ = toy_model();
  const correct::WholePose whole_{"both", bent(model_, 0.9, 0.8)};
};

TEST_F(PosePlaces, GiveBackWhatSettledAtThatPoseAlone) {
  const std::vector<float> skinned = nodes_of(model_, whole_.pose),
                           settled = pushed(model_, skinned, 60, 240);
  Model corrected = model_;
  corrected.pose_corrections = correct::pose_places(model_, whole_, {}, skinned, settled, {.rounding_mm = 0});
  ASSERT_FALSE(corrected.pose_corrections.empty());
  EXPECT_LT(farthest(nodes_of(corrected, whole_.pose), settled), 2e-3);
  for (const Pose& other : {Pose::rest(3), bent(model_, 0.3, 0.2), bent(model_, 1.5, 1.4)})
    EXPECT_EQ(nodes_of(corrected, other), nodes_of(model_, other));
  // Carried along when the whole body turns.
  Pose turned = whole_.pose;
  turned.rotation[0] = Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY());
  EXPECT_LT(farthest(nodes_of(corrected, turned), settled), 2e-3);
}

TEST_F(PosePlaces, AreDecidedByTheJointsAboutThem) {
  const std::vector<float> skinned = nodes_of(model_, whole_.pose);
  const auto places =
      correct::pose_places(model_, whole_, {}, skinned, pushed(model_, skinned, 80, 120), {.few = 1});
  ASSERT_EQ(places.size(), 1U);
  EXPECT_EQ(places[0].joint, std::vector<std::int32_t>{1});
  Model corrected = model_;
  corrected.pose_corrections = places;
  // Whatever the other joint does, the place stays as it settled.
  const Pose other = bent(model_, 0.9, 0.1);
  EXPECT_GT(farthest(nodes_of(corrected, other), nodes_of(model_, other)), 3);
}

TEST_F(PosePlaces, ReachNoOtherPoseNorRest) {
  const std::vector<float> skinned = nodes_of(model_, whole_.pose),
                           settled = pushed(model_, skinned, 80, 120);
  const correct::PlaceOptions options{.few = 1};
  const std::vector<correct::WholePose> others{{"near", bent(model_, 0.7, 0.8)},
                                               {"alike", bent(model_, 0.88, 0.1)}};
  EXPECT_NEAR(correct::pose_places(model_, whole_, {}, skinned, settled, options).at(0).reach, options.reach,
              1e-12);
  EXPECT_NEAR(correct::pose_places(model_, whole_, others, skinned, settled, options).at(0).reach, 0.2, 1e-9);
  const correct::WholePose slight{"slight", bent(model_, 0.15, 0.8)};
  EXPECT_NEAR(correct::pose_places(model_, slight, {}, skinned, settled, options).at(0).reach, 0.15, 1e-9);
  const correct::WholePose still{"still", bent(model_, 0.01, 0.8)};
  EXPECT_TRUE(correct::pose_places(model_, still, {}, skinned, settled, options).empty());
}

TEST_F(PosePlaces, OfAFewNodesJoinThoseThatHaveTheirJoints) {
  // About the tip's joint some hang on the base, too: both joints decide there.
  for (std::size_t n = 0; n < model_.node_count(); ++n)
    if (std::abs(model_.nodes(static_cast<Eigen::Index>(n), 2) - 183) < 5)
      model_.weights.segment[model_.weights.offsets[n]] = 0;
  const std::vector<float> skinned = nodes_of(model_, whole_.pose);
  const std::vector<float> settled = pushed(model_, pushed(model_, skinned, 95, 120), 180, 240);
  const auto apart = correct::pose_places(model_, whole_, {}, skinned, settled, {.few = 1});
  const auto joined = correct::pose_places(model_, whole_, {}, skinned, settled, {.few = 20});
  ASSERT_EQ(apart.size(), 2U);
  EXPECT_EQ(apart[0].joint, std::vector<std::int32_t>{1});
  EXPECT_LT(apart[0].node.size(), 20U);
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined[0].joint, (std::vector<std::int32_t>{1, 2}));
  EXPECT_EQ(joined[0].node.size(), apart[0].node.size() + apart[1].node.size());
  EXPECT_TRUE(std::is_sorted(joined[0].node.begin(), joined[0].node.end()));
}

TEST_F(PosePlaces, OfWhatDoesNotMoveThereAreNone) {
  const std::vector<float> skinned = nodes_of(model_, whole_.pose);
  EXPECT_TRUE(correct::pose_places(model_, whole_, {}, skinned, skinned, {}).empty());
}

}  // namespace
}  // namespace ecorche::test
