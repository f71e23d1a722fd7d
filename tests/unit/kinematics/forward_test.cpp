// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/forward.hpp>

#include <gtest/gtest.h>

#include <numbers>

#include <ecorche/values/error.hpp>
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::turn;
constexpr double pi = std::numbers::pi;

TEST(Forward, RestIsTheIdentityToTheLastBit) {
  std::mt19937 random(1);
  Rig rig = test::chain(5);
  for (Segment& segment : rig.skeleton.segments) {
    segment.joint.axes = test::random_turn(random).toRotationMatrix();
    segment.joint.center += Vector3d(0.1, 17.3, 1234.5);
  }
  for (const RigidTransform& m : forward(rig, Pose::rest(5))) {
    EXPECT_EQ(m.q.coeffs(), Quaterniond::Identity().coeffs());
    EXPECT_EQ(m.t, Vector3d::Zero());
  }
}

TEST(Forward, ChainBentAtTwoJointsByHand) {
  const Rig rig = test::chain(3);
  Pose pose = Pose::rest(3);
  pose.rotation[1] = turn(Vector3d::UnitX(), pi / 2);  // z becomes -y above (0, 0, 100)
  pose.rotation[2] = turn(Vector3d::UnitX(), pi / 2);
  const auto m = forward(rig, pose);
  EXPECT_LT((m[0] * Vector3d(1, 2, 3) - Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((m[1] * Vector3d(0, 0, 200) - Vector3d(0, -100, 100)).norm(), 1e-12);
  EXPECT_LT((m[2] * Vector3d(0, 0, 300) - Vector3d(0, -100, 0)).norm(), 1e-12);
}

TEST(Forward, TurnsAboutTheAxesOfTheJoint) {
  Rig rig = test::chain(2);
  Joint& joint = rig.skeleton.segments[1].joint;
  joint.axes.col(0) = Vector3d::UnitZ();
  joint.axes.col(1) = Vector3d::UnitX();
  joint.axes.col(2) = Vector3d::UnitY();
  Pose pose = Pose::rest(2);
  pose.rotation[1] = turn(Vector3d::UnitX(), pi / 2);  // the joint's x is the patient's z
  pose.translation[1] = {0, 5, 0};                     // the joint's y is the patient's x
  const auto m = forward(rig, pose);
  EXPECT_LT((m[1] * Vector3d(10, 0, 100) - Vector3d(5, 10, 100)).norm(), 1e-12);
}

TEST(Forward, RootMovesEverything) {
  std::mt19937 random(2);
  const Rig rig = test::chain(4);
  Pose pose = Pose::rest(4);
  for (auto& q : pose.rotation) q = test::random_turn(random);
  Pose moved = pose;
  const RigidTransform body{test::random_turn(random), {3000, -200, 40}};
  moved.rotation[0] = body.q * pose.rotation[0];  // the root's centre is the origin and its axes are LPS
  moved.root_translation = body.t;
  const auto before = forward(rig, pose), after = forward(rig, moved);
  for (std::size_t s = 0; s < 4; ++s) {
    const Vector3d x(10, 20, 30);
    EXPECT_LT((after[s] * x - body * (before[s] * x)).norm(), 1e-9);
  }
}

TEST(Forward, EachChildIsBesideItsParentWhateverSignsThePoseHas) {
  std::mt19937 random(3);
  const Rig rig = test::chain(8);
  for (int trial = 0; trial < 100; ++trial) {
    Pose pose = Pose::rest(8);
    for (auto& q : pose.rotation) q = test::random_turn(random);
    Pose flipped = pose;
    for (std::size_t j = 0; j < 8; j += 2) flipped.rotation[j].coeffs() *= -1;
    const auto a = forward(rig, pose), b = forward(rig, flipped);
    for (std::size_t s = 1; s < 8; ++s) {
      EXPECT_GE(a[s].q.dot(a[s - 1].q), -1e-15);
      EXPECT_NEAR(a[s].q.norm(), 1, 1e-14);
      EXPECT_LT((a[s].q.coeffs() - b[s].q.coeffs()).norm(), 1e-12) << "signs of a pose mean nothing";
    }
  }
}

TEST(Forward, TurnsThatAddUpBeyondAWholeTurnStaySmoothAlongTheChain) {
  const Rig rig = test::chain(7);
  Pose pose = Pose::rest(7);
  for (std::size_t j = 1; j < 7; ++j)
    pose.rotation[j] = turn(Vector3d::UnitZ(), pi / 2);  // 540 degrees in all
  const auto m = forward(rig, pose);
  for (std::size_t s = 1; s < 7; ++s) EXPECT_NEAR(m[s].q.dot(m[s - 1].q), std::cos(pi / 4), 1e-12);
  EXPECT_NEAR(m[4].q.w(), -1, 1e-12) << "a whole turn away from the root, not beside it";
}

TEST(Forward, RefusesAPoseOfAnotherRig) {
  expect_error(ErrorKind::internal,
               "a pose of 2 rotations and 2 translations for 3 joints (make one of each for every joint",
               [] { forward(test::chain(3), Pose::rest(2)); });
  std::vector<RigidTransform> out(2);
  EXPECT_THROW(forward(test::chain(3), Pose::rest(3), out), Error);
}

}  // namespace
}  // namespace ecorche::kinematics
