// SPDX-License-Identifier: Apache-2.0
// Balls that hang by hand turn about other joints: beside forward kinematics of the changed rig.
#include "runtime/spheres/hanging.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include <ecorche/kinematics/forward.hpp>
#include "runtime/spheres/pose_volume.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kMiddle = 1, kTip = 2;

std::vector<Vec3> joints_of(const Skeleton& rig) {
  return hanging_of({}, rig).joint;
}

Pose any_pose(std::size_t segments, std::mt19937& random) {
  std::normal_distribution<double> number;
  Pose pose = Pose::rest(segments);
  pose.root_translation = {number(random), number(random), number(random)};
  for (std::size_t s = 0; s < segments; ++s) {
    pose.rotation[s] =
        Eigen::Quaterniond(number(random), number(random), number(random), number(random)).normalized();
  }
  return pose;
}

TEST(Hanging, JointsThatMovedEqualForwardKinematicsOfTheRigWithThemThere) {
  const Model model = test::toy_model();
  const Skeleton& rig = model.rig.skeleton;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> way(-40, 40);
  for (int round = 0; round < 50; ++round) {
    std::vector<Vec3> joint = joints_of(rig);
    // One of them, or all.
    for (std::size_t s = 0; s < joint.size(); ++s) {
      if (round % 4 != 3 && static_cast<int>(s) != round % 4) continue;
      for (double& x : joint[s]) x += way(random);
    }
    Rig moved = model.rig;
    moved.skeleton = with_joints(rig, joint);
    const Pose pose = any_pose(rig.segments.size(), random);
    const auto expected = kinematics::forward(moved, pose);
    const auto found = about_joints(rig, joint, kinematics::forward(model.rig, pose));
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t s = 0; s < found.size(); ++s) {
      for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(30, -20, 290)})
        EXPECT_LT((found[s] * at - expected[s] * at).norm(), 1e-9) << round << ", segment " << s;
    }
  }
}

TEST(Hanging, WhereNoJointMovedTheMotionsAreTheSameToTheLastBit) {
  const Model model = test::toy_model();
  std::mt19937 random(3);
  const auto motions = kinematics::forward(model.rig, any_pose(model.rig.skeleton.segments.size(), random));
  std::vector<Vec3> joint = joints_of(model.rig.skeleton);
  const auto same = [&](std::size_t s) {
    const auto found = about_joints(model.rig.skeleton, joint, motions);
    return found[s].q.coeffs() == motions[s].q.coeffs() && found[s].t == motions[s].t;
  };
  for (std::size_t s = 0; s < motions.size(); ++s) EXPECT_TRUE(same(s)) << s;
  joint[kTip][0] += 1;
  EXPECT_TRUE(same(0) && same(kMiddle)) << "what hangs before it stays";
  EXPECT_FALSE(same(kTip));
}

// A quarter turn about z moves a point at (d, 0) from its axis to (0, d).
TEST(Hanging, AHingeMovedAsideTurnsAboutItsNewPlace) {
  const Model model = test::toy_model();
  Pose pose = Pose::rest(model.rig.skeleton.segments.size());
  const Eigen::Matrix3d& axes = model.rig.skeleton.segments[kTip].joint.axes;
  pose.rotation[kTip] = Eigen::AngleAxisd(std::numbers::pi / 2, axes.transpose() * Eigen::Vector3d::UnitZ());
  std::vector<Vec3> joint = joints_of(model.rig.skeleton);
  joint[kTip] = {10, 0, 200};
  const auto found = about_joints(model.rig.skeleton, joint, kinematics::forward(model.rig, pose));
  EXPECT_LT((found[kTip] * Eigen::Vector3d(13, 0, 250) - Eigen::Vector3d(10, 3, 250)).norm(), 1e-12);
  EXPECT_LT((found[kMiddle] * Eigen::Vector3d(13, 0, 150) - Eigen::Vector3d(13, 0, 150)).norm(), 1e-12);
}

TEST(Hanging, BallsGoWithTheSegmentThatTheyHangOn) {
  const Model model = test::toy_model();
  const VolumetricSkeleton& skeleton = spheres_for(model, model.volumes[0]);
  Hanging by_hand = hanging_of(skeleton, model.rig.skeleton);
  const VolumeBalls own(model, model.volumes[0]), same(model, model.volumes[0], by_hand);
  std::mt19937 random(5);
  const auto motions = kinematics::forward(model.rig, any_pose(model.rig.skeleton.segments.size(), random));
  const BallSet hung = same.at(motions), given = own.at(motions);
  ASSERT_EQ(hung.balls.size(), given.balls.size());
  for (std::size_t i = 0; i < hung.balls.size(); ++i) EXPECT_EQ(hung.balls[i].centre, given.balls[i].centre);
  by_hand.segment.assign(by_hand.segment.size(), 0);
  const VolumeBalls all_on_the_base(model, model.volumes[0], by_hand);
  const std::vector<RigidTransform> as_one(motions.size(), motions[0]);
  const BallSet found = all_on_the_base.at(motions), expected = own.at(as_one);
  EXPECT_EQ(found.balls.size(), skeleton.size()) << "nothing opens within one segment";
  for (std::size_t i = 0; i < skeleton.size(); ++i)
    EXPECT_EQ(found.balls[i].centre, expected.balls[i].centre) << i;
}

}  // namespace
}  // namespace ecorche::runtime
