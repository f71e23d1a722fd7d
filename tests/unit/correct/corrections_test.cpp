// SPDX-License-Identifier: Apache-2.0
// The correction at run time against its slow twin, and what it must leave alone.
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <memory>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "tests/support/toy_model.hpp"
#include "tests/unit/correct/slow_correction.hpp"

namespace ecorche::test {
namespace {

using runtime::BodyPoser;
using runtime::PosedBody;
using runtime::Skinning;

// A hinge and a ball, the latter with five samples in two modes.
std::shared_ptr<Model> corrected_toy() {
  return std::make_shared<Model>(corrected_toy_model());
}

Pose pose_of(const Model& model, double bend, const Eigen::Vector3d& tip) {
  Pose pose = Pose::rest(model.segment_count());
  const Joint& hinge = model.rig.skeleton.segments[1].joint;
  pose.rotation[1] =
      Eigen::AngleAxisd(bend * hinge.sequence[0].sign, Eigen::Vector3d::Unit(hinge.sequence[0].axis));
  if (tip.norm() > 0) pose.rotation[2] = Eigen::AngleAxisd(tip.norm(), tip.normalized());
  pose.rotation[0] = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  pose.root_translation = {100, -50, 20};
  return pose;
}

PosedBody posed(const BodyPoser& poser, const Pose& pose, Skinning skinning = Skinning::cor) {
  PosedBody body = poser.make_frame({.positions = true, .quantised = true, .normals = true});
  EXPECT_TRUE(poser.run(pose, skinning, poser.all_tissues(), body).ok());
  return body;
}

TEST(Corrections, AreThoseOfTheSlowTwin) {
  const auto model = corrected_toy();
  const BodyPoser poser(model);
  double moved = 0;
  for (const auto& [bend, tip] :
       {std::pair{0.2, Eigen::Vector3d(0, 0, 0)}, std::pair{0.5, Eigen::Vector3d(0.2, 0.1, 0)},
        std::pair{-0.3, Eigen::Vector3d(-0.1, 0.2, 0.3)}, std::pair{0.3, Eigen::Vector3d(0.3, 0.3, 0.2)},
        std::pair{0.0, Eigen::Vector3d(0.1, 0, -0.1)}}) {
    const PosedBody body = posed(poser, pose_of(*model, bend, tip));
    const auto segments = kinematics::forward(model->rig, body.pose);
    const auto expected = slow_corrected_nodes(*model, body.pose, segments);
    EXPECT_LT(farthest(body.nodes, expected), 1e-3);
    moved = std::max(moved, farthest(body.nodes, reference_nodes(*model, segments, Skinning::cor, 1e-4)));
    for (std::size_t t = 0; t < model->tissues.size(); ++t)
      EXPECT_LT(farthest(body.tissues[t], reference_tissue(*model, model->tissues[t], segments, expected)),
                2e-3);
  }
  EXPECT_GT(moved, 3);
}

// Nodes that both joints move, by up to some centimetres.
std::shared_ptr<Model> crowded_toy() {
  auto model = corrected_toy();
  JointCorrection &hinge = model->corrections[0], &ball = model->corrections[1];
  for (float& scale : hinge.scale) scale *= 3;
  for (float& scale : ball.scale) scale *= 3;
  hinge.node = ball.node;
  model->pose_corrections.clear();
  hinge.field.resize(3 * hinge.scale.size() * hinge.node.size(), 9000);
  return model;
}

TEST(Corrections, OfJointsThatMoveTheSameFleshMakeRoomOnce) {
  const auto model = crowded_toy();
  const BodyPoser poser(model);
  double left_out = 0;
  for (const double bend : {0.1, 0.3, 0.5}) {
    const PosedBody body = posed(poser, pose_of(*model, bend, Eigen::Vector3d(0.3, bend, 0.1)));
    const auto segments = kinematics::forward(model->rig, body.pose);
    EXPECT_LT(farthest(body.nodes, slow_corrected_nodes(*model, body.pose, segments)), 2e-3);
    std::vector<Eigen::Vector3d> sum = reference_nodes(*model, segments, Skinning::cor, 1e-4);
    for (const JointCorrection& only : model->corrections) {
      Model alone = *model;
      alone.corrections = {only};
      alone.pose_corrections.clear();
      const auto one = slow_corrected_nodes(alone, body.pose, segments);
      const auto none = reference_nodes(*model, segments, Skinning::cor, 1e-4);
      for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += one[n] - none[n];
    }
    left_out = std::max(left_out, farthest(body.nodes, sum));
  }
  EXPECT_GT(left_out, 5);
}

TEST(Corrections, OfAWholePoseFadeAwayFromIt) {
  const auto model = corrected_toy();
  auto joints_alone = std::make_shared<Model>(*model);
  joints_alone->pose_corrections.clear();
  const BodyPoser poser(model), alone(joints_alone);
  double before = std::numeric_limits<double>::infinity(), nearest = 0;
  for (const double off : {0.0, 0.1, 0.3, 0.45, 0.51}) {
    const Pose pose = pose_of(*model, 0.7 - off, Eigen::Vector3d(0.1, 0.3, -0.2));
    const PosedBody body = posed(poser, pose);
    const auto segments = kinematics::forward(model->rig, body.pose);
    EXPECT_LT(farthest(body.nodes, slow_corrected_nodes(*model, body.pose, segments)), 1e-3);
    const double far = farthest(body.nodes, slow_corrected_nodes(*joints_alone, body.pose, segments));
    EXPECT_LT(far, before);
    before = far;
    nearest = std::max(nearest, far);
    EXPECT_EQ(body.nodes == posed(alone, pose).nodes, off > 0.5);
  }
  EXPECT_GT(nearest, 5);
}

TEST(Corrections, EndWhereTheirSamplesEnd) {
  const auto model = corrected_toy();
  const BodyPoser poser(model);
  const auto beyond = pose_of(*model, 1.2, Eigen::Vector3d(0.9, 0, 0));
  const PosedBody body = posed(poser, beyond);
  const auto segments = kinematics::forward(model->rig, body.pose);
  EXPECT_LT(farthest(body.nodes, slow_corrected_nodes(*model, body.pose, segments)), 1e-3);
}

TEST(Corrections, LeaveRestAndBonesToTheBit) {
  const auto with = corrected_toy();
  auto without = std::make_shared<Model>(*with);
  without->corrections.clear();
  without->pose_corrections.clear();
  const BodyPoser corrected(with), plain(without);
  Pose rest = pose_of(*with, 0, Eigen::Vector3d::Zero());
  EXPECT_EQ(posed(corrected, rest).nodes, posed(plain, rest).nodes);
  const Pose bent = pose_of(*with, 0.5, Eigen::Vector3d(0.2, 0.1, 0));
  const PosedBody a = posed(corrected, bent), b = posed(plain, bent);
  EXPECT_NE(a.nodes, b.nodes);
  std::size_t bones = 0;
  for (std::size_t t = 0; t < with->tissues.size(); ++t) {
    if (with->tissues[t].segment == Tissue::by_tets) continue;
    ++bones;
    EXPECT_EQ(a.tissues[t], b.tissues[t]);
    EXPECT_EQ(a.normals[t], b.normals[t]);
  }
  EXPECT_GT(bones, 0U);
  std::vector<std::uint8_t> free(with->node_count(), 0);
  for (const JointCorrection& c : with->corrections)
    for (const std::uint32_t n : c.node) free[n] = 1;
  for (std::size_t n = 0; n < free.size(); ++n) {
    if (free[n] != 0) continue;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(a.nodes[3 * n + c], b.nodes[3 * n + c]) << n;
  }
}

TEST(Corrections, AreOfCentresOfRotationAlone) {
  const auto with = corrected_toy();
  auto without = std::make_shared<Model>(*with);
  without->corrections.clear();
  const BodyPoser corrected(with), plain(without);
  const Pose bent = pose_of(*with, 0.5, Eigen::Vector3d(0.2, 0.1, 0));
  for (const Skinning skinning : {Skinning::lbs, Skinning::dqs})
    EXPECT_EQ(posed(corrected, bent, skinning).nodes, posed(plain, bent, skinning).nodes);
}

TEST(Corrections, HaveNoMemoryAndCareForNoThreads) {
  const BodyPoser poser(corrected_toy());
  const Pose bent = pose_of(poser.model(), 0.5, Eigen::Vector3d(0.2, 0.1, 0));
  PosedBody again = poser.make_frame();
  for (const double bend : {0.9, 0.0, -0.4})
    ASSERT_TRUE(
        poser.run(pose_of(poser.model(), bend, {0.1, 0, 0}), Skinning::cor, poser.all_tissues(), again).ok());
  tbb::task_arena(1).execute(
      [&] { ASSERT_TRUE(poser.run(bent, Skinning::cor, poser.all_tissues(), again).ok()); });
  EXPECT_EQ(posed(poser, bent).nodes, again.nodes);
}

void expect_refused(const std::shared_ptr<Model>& model, const std::string& what) {
  try {
    const BodyPoser poser(model);
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_NE(std::string(error.what()).find(what), std::string::npos);
  }
}

TEST(Corrections, ThatDoNotFitAreRefused) {
  for (const auto& harm :
       {+[](JointCorrection& c) { c.joint = 3; }, +[](JointCorrection& c) { c.field.pop_back(); },
        +[](JointCorrection& c) { c.node.back() = 1'000'000; },
        +[](JointCorrection& c) { c.turn.resize(0, 3), c.mix.resize(0, 3); },
        +[](JointCorrection& c) { c.turn.setOnes(257, 3), c.mix.setOnes(257, 3); },
        +[](JointCorrection& c) { c.mix.resize(1, 1); }}) {
    const auto model = corrected_toy();
    harm(model->corrections[0]);
    expect_refused(model, "a correction does not fit");
  }
}

TEST(Corrections, OfAWholePoseThatDoNotFitAreRefused) {
  for (const auto& harm :
       {+[](PoseCorrection& c) { c.joint[1] = 3; },
        +[](PoseCorrection& c) { c.turn.conservativeResize(1, 3); }, +[](PoseCorrection& c) { c.reach = 0; },
        +[](PoseCorrection& c) { c.node.back() = 1'000'000; },
        +[](PoseCorrection& c) { c.field.pop_back(); }}) {
    const auto model = corrected_toy();
    harm(model->pose_corrections[0]);
    expect_refused(model, "' does not fit its nodes and joints");
  }
}

}  // namespace
}  // namespace ecorche::test
