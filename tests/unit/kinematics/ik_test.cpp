// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/ik.hpp>

#include <gtest/gtest.h>

#include <numbers>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/values/error.hpp>
#include "core/kinematics/marker_fit.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kInRadians = std::numbers::pi / 180;
constexpr double kUpper = 300, kFore = 250;

// A trunk at the origin, an arm that hangs, straight: ball, hinge (flexion 0 to 150 degrees), hand.
Rig arm() {
  Rig rig;
  const auto add = [&](const char* name, int parent, JointKind kind, const Vector3d& center) -> Joint& {
    Segment segment;
    segment.name = name;
    segment.parent = parent;
    segment.joint.name = std::string(name) + "_joint";
    segment.joint.kind = kind;
    segment.joint.center = center;
    segment.joint.sequence = test::sequence({0, 1, 2}, {-1, 1, 1});
    rig.skeleton.segments.push_back(segment);
    rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
    return rig.skeleton.segments.back().joint;
  };
  add("trunk", -1, JointKind::free, {0, 0, 0});
  add("upper", 0, JointKind::ball, {200, 0, 500});
  AngleAxis& elbow = add("fore", 1, JointKind::hinge, {200, 0, 500 - kUpper}).sequence[0];
  elbow.min = 0;
  elbow.max = 150 * kInRadians;
  add("hand", 2, JointKind::universal, {200, 0, 500 - kUpper - kFore});
  return rig;
}

const Vector3d kShoulder(200, 0, 500), kWrist(200, 0, 500 - kUpper - kFore);

double elbow_of(const Rig& rig, const Pose& pose) {
  return angles_from_rotation(rig.skeleton.segments[2].joint, pose.rotation[2])[0];
}

IkProblem wrist_to(const Vector3d& goal) {
  IkProblem problem;
  problem.targets.push_back({2, kWrist, goal, 1});
  return problem;
}

// By the law of cosines.
TEST(Ik, TwoLinksBendAsTheyMust) {
  const Rig rig = arm();
  for (const double distance : {520.0, 400.0, 200.0}) {
    const Vector3d goal = kShoulder + distance * Vector3d(0.3, -0.8, -0.4).normalized();
    const IkResult result = solve_ik(rig, Pose::rest(4), wrist_to(goal));
    EXPECT_TRUE(result.reached) << distance << ": " << result.away_mm[0];
    const double inner =
        std::acos((kUpper * kUpper + kFore * kFore - distance * distance) / (2 * kUpper * kFore));
    EXPECT_NEAR(elbow_of(rig, result.pose), std::numbers::pi - inner, 0.005) << distance;
    const auto motion = forward(rig, result.pose);
    EXPECT_NEAR((motion[2] * kWrist - goal).norm(), result.away_mm[0], 1e-9);
    EXPECT_LT(result.away_mm[0], 0.1);
  }
}

TEST(Ik, OutOfReachItPointsThere) {
  const Rig rig = arm();
  const IkResult result = solve_ik(rig, Pose::rest(4), wrist_to(kShoulder + Vector3d(0, -800, 0)));
  EXPECT_FALSE(result.reached);
  EXPECT_NEAR(result.away_mm[0], 800 - kUpper - kFore, 3);
}

// No small turn shortens a straight arm: it must be bent first.
TEST(Ik, AStraightArmIsPulledIn) {
  const Rig rig = arm();
  const IkResult result = solve_ik(rig, Pose::rest(4), wrist_to(kWrist + Vector3d(0, 0, 150)));
  EXPECT_TRUE(result.reached) << result.away_mm[0];
}

// The twin looks at every elbow angle that the limit leaves; the shoulder turns the wrist to any side.
TEST(Ik, LimitsHoldAndTheRestIsTheBest) {
  Rig rig = arm();
  rig.skeleton.segments[2].joint.sequence[0].max = 80 * kInRadians;
  const Vector3d goal = kShoulder + Vector3d(0, -220, 0);
  const IkResult result = solve_ik(rig, Pose::rest(4), wrist_to(goal));
  double best = 1e9;
  for (double angle = 0; angle <= 80; angle += 0.01) {
    const double inner = std::numbers::pi - angle * kInRadians;
    const double reach = std::sqrt(kUpper * kUpper + kFore * kFore - 2 * kUpper * kFore * std::cos(inner));
    best = std::min(best, std::abs(reach - 220));
  }
  EXPECT_LE(elbow_of(rig, result.pose), 80 * kInRadians + 1e-9);
  EXPECT_NEAR(result.away_mm[0], best, 0.5);
}

// A body of two such legs: pelvis, thighs, shanks, feet, a head that looks, a hand on a long trunk.
Rig body() {
  Rig rig = arm();
  const auto leg = [&](double x, const char* side) {
    for (int k = 0; k < 3; ++k) {
      Segment segment;
      segment.name = std::string(k == 0 ? "thigh" : k == 1 ? "shank" : "foot") + side;
      segment.parent = k == 0 ? 0 : static_cast<int>(rig.skeleton.segments.size()) - 1;
      segment.joint.name = segment.name + "_joint";
      segment.joint.kind = k == 1 ? JointKind::hinge : JointKind::ball;
      segment.joint.center = {x, 0, -20.0 - 400.0 * k};
      segment.joint.sequence = test::sequence({0, 1, 2}, {k == 1 ? 1.0 : -1.0, 1, 1});
      segment.joint.sequence[0].min = (k == 1 ? 0 : -60) * kInRadians;
      segment.joint.sequence[0].max = 140 * kInRadians;
      rig.skeleton.segments.push_back(segment);
      rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
    }
  };
  leg(90, "_left");
  leg(-90, "_right");
  Segment head;
  head.name = "head";
  head.parent = 0;
  head.joint.name = "neck";
  head.joint.center = {0, 0, 600};
  head.joint.sequence = test::sequence({0, 1, 2});
  for (AngleAxis& angle : head.joint.sequence) {
    angle.min = -50 * kInRadians;
    angle.max = 50 * kInRadians;
  }
  rig.skeleton.segments.push_back(head);
  rig.fits.push_back({"neck", CenterRule::given, 0, 0, 1, 0});
  return rig;
}

TEST(Ik, FeetStayWhileTheBodyGoesDown) {
  const Rig rig = body();
  IkProblem problem;
  problem.move_root = true;
  for (const std::size_t foot : {std::size_t{6}, std::size_t{9}}) {
    const Vector3d ankle = rig.skeleton.segments[foot].joint.center;
    for (const Vector3d& by : {Vector3d(0, 0, 0), Vector3d(0, -150, -50)})
      problem.targets.push_back({foot, ankle + by, ankle + by, 3});
  }
  problem.targets.push_back({0, {0, 0, 0}, {0, 20, -200}, 1});
  const IkResult result = solve_ik(rig, Pose::rest(11), problem);
  EXPECT_TRUE(result.reached);
  for (const double away : result.away_mm) EXPECT_LT(away, 0.1);
  for (const std::size_t shank : {std::size_t{5}, std::size_t{8}})
    EXPECT_GT(angles_from_rotation(rig.skeleton.segments[shank].joint, result.pose.rotation[shank])[0],
              40 * kInRadians);
}

TEST(Ik, SeveralTargetsAndALook) {
  const Rig rig = body();
  IkProblem problem = wrist_to({300, -350, 450});
  problem.targets.push_back({5, {90, 0, -820}, {120, -500, -450}, 1});
  problem.looks.push_back({10, {0, -80, 650}, {0, -1, 0}, {400, -900, 500}, 1});
  const IkResult result = solve_ik(rig, Pose::rest(11), problem);
  EXPECT_TRUE(result.reached);
  EXPECT_LT(result.off[0], 0.001);
  // By hand: from where the eyes are to where they look.
  const auto motion = forward(rig, result.pose);
  const Vector3d eye = motion[10] * Vector3d(0, -80, 650), to = Vector3d(400, -900, 500) - eye;
  EXPECT_GT((motion[10].q * Vector3d(0, -1, 0)).dot(to.normalized()), std::cos(0.001));
  // Behind the back: as far as the neck goes.
  problem.looks[0].at = {100, 900, 600};
  const IkResult behind = solve_ik(rig, Pose::rest(11), problem);
  EXPECT_GT(behind.off[0], 30 * kInRadians);
  EXPECT_LT(behind.off[0], 175 * kInRadians);
}

TEST(Ik, CoupledJointsFollow) {
  Rig rig = test::chain(4);
  rig.skeleton.segments[2].joint.coupled = {{"j1", "flexion", "flexion", 0.5},
                                            {"j1", "adduction", "adduction", 0},
                                            {"j1", "rotation", "rotation", 0}};
  IkProblem problem;
  problem.targets.push_back({3, {0, 0, 400}, {0, -150, 330}, 1});
  const IkResult result = solve_ik(rig, Pose::rest(4), problem);
  EXPECT_TRUE(result.reached) << result.away_mm[0];
  const double leads = angles_from_rotation(rig.skeleton.segments[1].joint, result.pose.rotation[1])[0];
  const double follows = angles_from_rotation(rig.skeleton.segments[2].joint, result.pose.rotation[2])[0];
  EXPECT_GT(std::abs(leads), 0.01);
  EXPECT_NEAR(follows, 0.5 * leads, 1e-9);
}

// Wherever a pose within the limits takes the hand and the foot, they can be taken from rest.
TEST(Ik, WhatAPoseReachesIsReached) {
  const Rig rig = body();
  std::mt19937 random(6);
  std::vector<ClampedJoint> clamped;
  int reached = 0;
  for (int round = 0; round < 200; ++round) {
    Pose pose = Pose::rest(11);
    for (std::size_t j = 1; j < 11; ++j)
      pose.rotation[j] = Quaterniond::Identity().slerp(0.5, test::random_turn(random));
    constrain(rig.skeleton, pose, clamped);
    const auto motion = forward(rig, pose);
    IkProblem problem = wrist_to(motion[2] * kWrist);
    problem.targets.push_back({5, {90, 0, -820}, motion[5] * Vector3d(90, 0, -820), 1});
    const IkResult result = solve_ik(rig, Pose::rest(11), problem);
    reached += result.reached ? 1 : 0;
    Pose again = result.pose;
    clamped.clear();
    constrain(rig.skeleton, again, clamped);
    EXPECT_TRUE(clamped.empty()) << "within every limit";
    ASSERT_EQ(solve_ik(rig, Pose::rest(11), problem).pose.rotation[1].coeffs(),
              result.pose.rotation[1].coeffs());
  }
  std::printf("%d of 200 reached\n", reached);
  EXPECT_GE(reached, 195);
}

TEST(Markers, ASimilarityIsFoundAgain) {
  std::mt19937 random(1);
  std::vector<Vector3d> x, y;
  const Quaterniond turn = test::random_turn(random);
  for (int i = 0; i < 6; ++i) {
    x.emplace_back(random() % 100, random() % 100, random() % 100);
    y.push_back(2.5 * (turn * x.back()) + Vector3d(1, 2, 3));
  }
  y[3] = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Similarity found = similarity(x, y);
  EXPECT_EQ(found.pairs, 5);
  EXPECT_NEAR(found.scale, 2.5, 1e-9);
  EXPECT_LT(found.turn.angularDistance(turn), 1e-9);
  EXPECT_LT((found.way - Vector3d(1, 2, 3)).norm(), 1e-6);
}

// A body that lies somewhere, turned, its limbs bent: its markers tell all of it.
TEST(Markers, AWholePoseIsFoundAgain) {
  const Rig rig = body();
  std::vector<MarkerOnBody> markers;
  for (std::size_t s = 0; s < 11; ++s) {
    for (const Vector3d& by : {Vector3d(40, 0, -60), Vector3d(-40, 10, -90), Vector3d(0, 50, -120)})
      markers.push_back({s, rig.skeleton.segments[s].joint.center + by});
  }
  Pose pose = Pose::rest(11);
  pose.root_translation = {300, -700, 90};
  pose.rotation[0] = test::turn(Vector3d(1, 0.2, 3), 2);
  pose.rotation[1] = test::turn(Vector3d(1, 1, 0), 0.7);
  pose.rotation[2] = rotation_from_angles(rig.skeleton.segments[2].joint, {0.8, 0, 0});
  pose.rotation[5] = rotation_from_angles(rig.skeleton.segments[5].joint, {0.9, 0, 0});
  const auto motion = forward(rig, pose);
  std::vector<Vector3d> seen;
  for (const MarkerOnBody& marker : markers) seen.push_back(motion[marker.segment] * marker.point);
  seen[4].setConstant(std::numeric_limits<double>::quiet_NaN());
  const IkResult found = fit_markers(rig, markers, seen, nullptr);
  EXPECT_TRUE(found.reached);
  for (std::size_t j = 0; j < 11; ++j)
    EXPECT_LT(found.pose.rotation[j].angularDistance(pose.rotation[j]), 0.03) << j;
}

TEST(Ik, RefusesASegmentThatIsNotThere) {
  IkProblem problem;
  problem.targets.push_back({9, {0, 0, 0}, {0, 0, 0}, 1});
  EXPECT_THROW(solve_ik(arm(), Pose::rest(4), problem), Error);
}

}  // namespace
}  // namespace ecorche::kinematics
