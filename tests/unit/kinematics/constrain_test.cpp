// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/values/error.hpp>
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Vector3d;
using test::turn;

TEST(Constrain, RestIsLeftAlone) {
  const Rig rig = test::chain(4);
  Pose pose = Pose::rest(4);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_TRUE(clamped.empty());
  for (const auto& q : pose.rotation) EXPECT_EQ(q.coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(Constrain, ReportsWhatAHingeCannotDo) {
  Rig rig = test::chain(3);
  rig.skeleton.segments[1].joint.kind = JointKind::hinge;
  Pose pose = Pose::rest(3);
  pose.rotation[1] = turn(Vector3d::UnitY(), 0.4);
  pose.rotation[2] = turn(Vector3d::UnitY(), 0.4);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  ASSERT_EQ(clamped.size(), 1u);
  EXPECT_EQ(clamped[0].joint, 1);
  EXPECT_NEAR(clamped[0].removed, 0.4, 1e-12);
  EXPECT_LT(pose.rotation[1].angularDistance(Eigen::Quaterniond::Identity()), 1e-12);
  EXPECT_NEAR(pose.rotation[2].angularDistance(Eigen::Quaterniond::Identity()), 0.4, 1e-12);
}

TEST(Constrain, TheRootIsThePlaceOfTheBody) {
  Rig rig = test::chain(2);
  rig.skeleton.segments[0].joint.kind = JointKind::fixed;
  Pose pose = Pose::rest(2);
  pose.rotation[0] = turn(Vector3d::UnitY(), 2);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_TRUE(clamped.empty());
  EXPECT_NEAR(pose.rotation[0].angularDistance(Eigen::Quaterniond::Identity()), 2, 1e-12);
}

// The roll-back of a knee: its own flexion, and another joint's, slide it along its axes at rest.
TEST(Constrain, SlidesFollowTheirLeaders) {
  Rig rig = test::chain(3);
  Joint& knee = rig.skeleton.segments[2].joint;
  const Joint& hip = rig.skeleton.segments[1].joint;
  const std::string own = knee.sequence[0].name, other = hip.sequence[1].name;
  knee.coupled = {{knee.name, own, "y_mm", -5}, {hip.name, other, "y_mm", 2}, {hip.name, other, "z_mm", 1}};
  Pose pose = Pose::rest(3);
  pose.rotation[1] =
      rotation_from_angles(hip, {hip.sequence[0].rest, hip.sequence[1].rest + 0.25, hip.sequence[2].rest});
  pose.rotation[2] =
      rotation_from_angles(knee, {knee.sequence[0].rest + 0.5, knee.sequence[1].rest, knee.sequence[2].rest});
  pose.translation[2] = {7, 8, 9};  // what was asked for is not the joint's to do
  const Eigen::Quaterniond asked = pose.rotation[2];
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_LT((pose.translation[2] - Vector3d(0, -5 * 0.5 + 2 * 0.25, 0.25)).norm(), 1e-9);
  EXPECT_LT(pose.rotation[2].angularDistance(asked), 1e-12);  // a slide turns nothing
  EXPECT_TRUE(clamped.empty());
}

TEST(Constrain, OnlyFreeJointsMoveAway) {
  Rig rig = test::chain(3);
  rig.skeleton.segments[2].joint.kind = JointKind::free;
  Pose pose = Pose::rest(3);
  pose.translation[1] = pose.translation[2] = {1, 2, 3};
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_EQ(pose.translation[1], Vector3d::Zero());
  EXPECT_EQ(pose.translation[2], Vector3d(1, 2, 3));
}

TEST(Constrain, CoupledAnglesFollowTheirLeaderAboutRest) {
  Rig rig = test::chain(4);
  auto& segments = rig.skeleton.segments;
  segments[1].joint.sequence[0].rest = 0.2;
  segments[1].joint.sequence[0].max = 1;
  segments[2].joint.sequence[1].rest = -0.1;
  segments[2].joint.coupled = {{"j1", "flexion", "adduction", 0.5}};
  segments[3].joint.coupled = {{"j2", "adduction", "rotation", -2}};
  Pose pose = Pose::rest(4);
  pose.rotation[1] = rotation_from_angles(segments[1].joint, {1.5, 0, 0});  // clamped to 1 before it leads
  pose.rotation[2] = rotation_from_angles(segments[2].joint, {0.3, 0.9, 0});
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  const auto second = angles_from_rotation(segments[2].joint, pose.rotation[2]);
  EXPECT_NEAR(second[0], 0.3, 1e-9) << "its own angle stays";
  EXPECT_NEAR(second[1], -0.1 + 0.5 * 0.8, 1e-9);
  EXPECT_NEAR(angles_from_rotation(segments[3].joint, pose.rotation[3])[2], -0.8, 1e-9);
  ASSERT_EQ(clamped.size(), 1u) << "following is not a limit";
  EXPECT_NEAR(clamped[0].removed, 0.5, 1e-9);

  Pose again = pose;
  clamped.clear();
  constrain(rig.skeleton, again, clamped);
  EXPECT_TRUE(clamped.empty()) << "what was constrained once stays";
  for (std::size_t j = 0; j < 4; ++j) EXPECT_LT(again.rotation[j].angularDistance(pose.rotation[j]), 1e-9);
}

// As a shoulder that is abducted beyond the horizontal: the plain triple of that rotation has another angle
// in the middle.
TEST(Constrain, ALeaderBeyondAQuarterTurnLeadsByTheAngleThatItsLimitsMean) {
  Rig rig = test::chain(3);
  auto& segments = rig.skeleton.segments;
  segments[1].joint.sequence[0].min = segments[1].joint.sequence[2].min = -1;
  segments[1].joint.sequence[0].max = segments[1].joint.sequence[2].max = 1;
  segments[1].joint.sequence[1].min = -2.1;
  segments[1].joint.sequence[1].max = 0.8;
  const double adducted = -1.9;
  segments[2].joint.coupled = {{"j1", "adduction", "flexion", 0.25}, {"j1", "adduction", "y_mm", 10}};
  Pose pose = Pose::rest(3);
  pose.rotation[1] = rotation_from_angles(segments[1].joint, {0.3, adducted, -0.2});
  ASSERT_GT(std::abs(angles_from_rotation(segments[1].joint, pose.rotation[1])[1] - adducted), 0.5);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_TRUE(clamped.empty());
  EXPECT_NEAR(angles_from_rotation(segments[2].joint, pose.rotation[2])[0], 0.25 * adducted, 1e-9);
  EXPECT_NEAR(pose.translation[2].y(), 10 * adducted, 1e-9);
}

TEST(Constrain, ACoupledAngleKeepsItsOwnLimits) {
  Rig rig = test::chain(3);
  auto& segments = rig.skeleton.segments;
  segments[2].joint.coupled = {{"j1", "flexion", "flexion", 1}};
  segments[2].joint.sequence[0].max = 0.25;
  Pose pose = Pose::rest(3);
  pose.rotation[1] = rotation_from_angles(segments[1].joint, {1, 0, 0});
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  EXPECT_NEAR(angles_from_rotation(segments[2].joint, pose.rotation[2])[0], 0.25, 1e-9);
  ASSERT_EQ(clamped.size(), 1u);
  EXPECT_EQ(clamped[0].joint, 2);
  EXPECT_NEAR(clamped[0].removed, 0.75, 1e-9);
}

TEST(Constrain, NamesACouplingThatLeadsNowhere) {
  Rig rig = test::chain(2);
  rig.skeleton.segments[1].joint.coupled = {{"wing", "flexion", "flexion", 1}};
  Pose pose = Pose::rest(2);
  std::vector<ClampedJoint> clamped;
  try {
    constrain(rig.skeleton, pose, clamped);
    FAIL() << "must throw";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::config);
    EXPECT_EQ(
        error.problem(),
        "is coupled to angle 'flexion' of joint 'wing' through its angle 'flexion', one of which is absent");
  }
}

}  // namespace
}  // namespace ecorche::kinematics
