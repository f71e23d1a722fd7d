// SPDX-License-Identifier: Apache-2.0
// What tracked tools do to a pose.
#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "app/igtl/tracked_pose.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::app::igtl {
namespace {

using Eigen::Vector3d;

RigidTransform turned(double angle, const Vector3d& axis, const Vector3d& gone) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis.normalized())), gone};
}

double apart(const RigidTransform& a, const RigidTransform& b) {
  return std::max(a.q.angularDistance(b.q), (a.t - b.t).norm());
}

// Three segments: 0 `base`, 1 `middle` on a hinge, 2 `tip` on a ball.
class Tracked : public ::testing::Test {
 protected:
  Rig rig_ = test::toy_model().rig;
  Pose rest_ = Pose::rest(3);

  TrackedPose tracked(const Bindings& bindings, const kinematics::IkProblem& goals = {}) const {
    return {rig_, rest_, goals, bindings};
  }
  RigidTransform motion(TrackedPose& pose, std::size_t segment) const {
    return kinematics::forward(rig_, pose.pose())[segment];
  }
};

TEST_F(Tracked, MotionsOfAPoseMakeThatPose) {
  Pose pose = rest_;
  pose.root_translation = {10, 20, 30};
  pose.rotation[0] = turned(0.4, {1, 2, 3}, {}).q;
  pose.rotation[1] = kinematics::rotation_from_angles(rig_.skeleton.segments[1].joint, {0.6, 0, 0});
  pose.rotation[2] = turned(0.3, {3, 1, -2}, {}).q;
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(rig_.skeleton, pose, clamped);
  const auto motions = kinematics::forward(rig_, pose);
  // The order in which they are bound does not matter.
  TrackedPose tracked_pose = tracked({.joints = {{"t", 2}, {"m", 1}, {"b", 0}}, .goals = {}});
  EXPECT_TRUE(tracked_pose.hear("t", motions[2]));
  EXPECT_TRUE(tracked_pose.hear("b", motions[0]));
  EXPECT_TRUE(tracked_pose.hear("m", motions[1]));
  for (std::size_t segment = 0; segment < 3; ++segment)
    EXPECT_LT(apart(motion(tracked_pose, segment), motions[segment]), 1e-9) << segment;
}

TEST_F(Tracked, AHingeTurnsOnlyAsItCanAndItsChildMakesUpForIt) {
  TrackedPose pose = tracked({.joints = {{"m", 1}, {"t", 2}}, .goals = {}});
  const RigidTransform wild = turned(0.5, {1, 1, 1}, {7, 7, 7});
  pose.hear("m", wild);
  pose.hear("t", wild);
  EXPECT_GT(motion(pose, 1).q.angularDistance(wild.q), 0.1);
  EXPECT_LT(motion(pose, 2).q.angularDistance(wild.q), 1e-9);
  // Only the root goes where it is told to: joints hold.
  const Vector3d& center = rig_.skeleton.segments[1].joint.center;
  EXPECT_LT((motion(pose, 1) * center - center).norm(), 1e-9);
}

TEST_F(Tracked, WhatIsNotBoundMovesNothing) {
  TrackedPose pose = tracked({.joints = {{"b", 0}}, .goals = {}});
  EXPECT_FALSE(pose.hear("x", turned(1, {1, 0, 0}, {})));
  EXPECT_LT(apart(motion(pose, 0), {}), 1e-12);
}

TEST_F(Tracked, FromFirstNothingMovesUntilTheToolDoes) {
  TrackedPose pose = tracked({.joints = {{"b", 0}}, .goals = {{"g", 2}}, .from_first = true});
  const RigidTransform fixed = turned(2, {0, 1, 1}, {500, 1, 2});
  pose.hear("b", fixed);
  EXPECT_LT(apart(motion(pose, 0), {}), 1e-9);
  const RigidTransform step = turned(0.2, {1, 0, 0}, {0, 0, 5});
  pose.hear("b", step * fixed);
  EXPECT_LT(apart(motion(pose, 0), step), 1e-9);
  pose.set(rest_);
  pose.hear("b", fixed);
  EXPECT_LT(apart(motion(pose, 0), {}), 1e-9);
}

TEST_F(Tracked, AGoalCountsOnceItsToolIsHeard) {
  TrackedPose pose = tracked({.joints = {}, .goals = {{"g", 2}}});
  EXPECT_LT(apart(motion(pose, 2), {}), 1e-12);
  const Vector3d center = rig_.skeleton.segments[2].joint.center;
  // Where the hinge at z = 100 carries it.
  const Joint& hinge = rig_.skeleton.segments[1].joint;
  Pose bent = rest_;
  bent.rotation[1] = kinematics::rotation_from_angles(hinge, {0.5, 0, 0});
  const Vector3d goal = kinematics::forward(rig_, bent)[2] * center;
  pose.hear("g", turned(3, {1, 2, 1}, goal));  // how the tool is turned does not matter
  EXPECT_LT((motion(pose, 2) * center - goal).norm(), 0.2);
}

TEST_F(Tracked, APoseByNameMovesThePinsAlong) {
  kinematics::IkProblem pinned;
  pinned.targets.push_back({0, Vector3d::Zero(), Vector3d::Zero(), 3});
  pinned.move_root = true;
  TrackedPose pose = tracked({.joints = {}, .goals = {{"g", 2}}}, pinned);
  pose.hear("g", turned(0, {1, 0, 0}, {20, 0, 190}));
  pose.pose();
  Pose gone = rest_;
  gone.root_translation = {100, 0, 0};
  pose.set(gone);
  EXPECT_LT((motion(pose, 0).t - Vector3d(100, 0, 0)).norm(), 1e-9);
  pose.hear("g", turned(0, {1, 0, 0}, {100, 0, 200}));
  EXPECT_LT((motion(pose, 0) * Vector3d::Zero() - Vector3d(100, 0, 0)).norm(), 1);
}

}  // namespace
}  // namespace ecorche::app::igtl
