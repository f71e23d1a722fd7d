// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/posed_rest.hpp"

#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

Rig turned_chain(std::mt19937& random) {
  Rig rig = test::chain(4);
  for (Segment& segment : rig.skeleton.segments) {
    segment.joint.axes = test::random_turn(random).toRotationMatrix();
    segment.joint.sequence = test::sequence({0, 1, 2}, {-1, 1, 1}, {0.3, -0.2, 0.1});
  }
  return rig;
}

Pose random_pose(std::mt19937& random) {
  Pose pose = Pose::rest(4);
  for (Quaterniond& q : pose.rotation) q = test::random_turn(random);
  pose.root_translation = {100, -40, 7};
  return pose;
}

// Posing the posed body goes on from where it stands.
TEST(PosedRest, TurnsComposeWithThePose) {
  std::mt19937 random(3);
  const Rig rig = turned_chain(random);
  const Pose first = random_pose(random);
  Rig posed = rig;
  posed.skeleton = posed_rest(rig, first);
  Pose more = Pose::rest(4), both = first;
  for (std::size_t s = 1; s < 4; ++s) {
    more.rotation[s] = test::random_turn(random);
    both.rotation[s] = first.rotation[s] * more.rotation[s];
  }
  const auto before = forward(rig, first), after = forward(posed, more), whole = forward(rig, both);
  for (std::size_t s = 0; s < 4; ++s) {
    for (const Vector3d& p : {Vector3d(1, 2, 3), Vector3d(-50, 10, 250)})
      EXPECT_LT((after[s] * (before[s] * p) - whole[s] * p).norm(), 1e-9) << s;
  }
}

// "Flexion 40 degrees" is the same stance, whichever scan it is said of.
TEST(PosedRest, NamedAnglesMeanTheSameStance) {
  std::mt19937 random(4);
  const Rig rig = turned_chain(random);
  Pose first = Pose::rest(4);
  for (std::size_t s = 0; s < 4; ++s)
    first.rotation[s] = rotation_from_angles(rig.skeleton.segments[s].joint, {0.5, -0.4, 0.8});
  Rig posed = rig;
  posed.skeleton = posed_rest(rig, first);
  Pose on_scan = first, on_posed = Pose::rest(4);
  const std::array<double, 3> asked{-0.2, 0.6, 0.1};
  for (std::size_t s = 1; s < 4; ++s) {
    EXPECT_NEAR(posed.skeleton.segments[s].joint.sequence[0].rest, 0.5, 1e-12);
    EXPECT_NEAR(posed.skeleton.segments[s].joint.sequence[2].rest, 0.8, 1e-12);
    on_scan.rotation[s] = rotation_from_angles(rig.skeleton.segments[s].joint, asked);
    on_posed.rotation[s] = rotation_from_angles(posed.skeleton.segments[s].joint, asked);
  }
  const auto before = forward(rig, first), after = forward(posed, on_posed), whole = forward(rig, on_scan);
  for (std::size_t s = 0; s < 4; ++s) {
    const Vector3d p(10, 20, 300);
    EXPECT_LT((after[s] * (before[s] * p) - whole[s] * p).norm(), 1e-9) << s;
  }
}

// Raised beyond a right angle: of the two triples the one that the limits allow.
TEST(PosedRest, TellsTheAnglesThatTheLimitsMean) {
  Rig rig = test::chain(2);
  Joint& shoulder = rig.skeleton.segments[1].joint;
  shoulder.sequence = test::sequence({0, 1, 2}, {1, -1, 1});
  for (AngleAxis& angle : shoulder.sequence) angle.min = -0.9, angle.max = 0.9;
  shoulder.sequence[1].min = -3;
  const std::array<double, 3> raised{0.2, -1.9, 0.3};
  Pose pose = Pose::rest(2);
  pose.rotation[1] = rotation_from_angles(shoulder, raised);
  const auto rest = [&] {
    const Skeleton posed = posed_rest(rig, pose);
    const auto& sequence = posed.segments[1].joint.sequence;
    return std::array{sequence[0].rest, sequence[1].rest, sequence[2].rest};
  };
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(rest()[a], raised[a], 1e-9) << a;
  // Where neither is within them, the one that is less outside: by one angle, not by three.
  shoulder.sequence[1].min = -0.5;
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(rest()[a], raised[a], 1e-9) << a;
  // Without limits each angle but the middle one turns all the way: the plain triple.
  shoulder.sequence = test::sequence({0, 1, 2}, {1, -1, 1});
  EXPECT_LT(std::abs(rest()[1]), 1.6);
}

// A knee that rolls back as it bends, scanned bent: stretched again it lies where it did.
TEST(PosedRest, SlidesGoOnAlongTheParent) {
  std::mt19937 random(6);
  Rig rig = turned_chain(random);
  Joint& knee = rig.skeleton.segments[2].joint;
  knee.name = "knee";
  knee.coupled = {{"knee", knee.sequence[0].name, "z_mm", -4}, {"knee", knee.sequence[1].name, "x_mm", 3}};
  const auto stance = [](const Skeleton& skeleton, const std::array<double, 3>& angles) {
    Pose pose = Pose::rest(4);
    for (std::size_t s = 1; s < 4; ++s)
      pose.rotation[s] = rotation_from_angles(skeleton.segments[s].joint, angles);
    slide(skeleton, pose);
    return pose;
  };
  const Pose first = stance(rig.skeleton, {1.2, -0.4, 0.8});
  EXPECT_GT(first.translation[2].norm(), 1);
  Rig posed = rig;
  posed.skeleton = posed_rest(rig, first);
  const std::array<double, 3> asked{-0.2, 0.6, 0.1};
  const auto before = forward(rig, first), after = forward(posed, stance(posed.skeleton, asked)),
             whole = forward(rig, stance(rig.skeleton, asked));
  for (std::size_t s = 0; s < 4; ++s) {
    const Vector3d p(10, 20, 300);
    EXPECT_LT((after[s] * (before[s] * p) - whole[s] * p).norm(), 1e-9) << s;
  }
}

TEST(PosedRest, TheRestPoseGivesTheSameSkeleton) {
  std::mt19937 random(5);
  const Rig rig = turned_chain(random);
  const Skeleton same = posed_rest(rig, Pose::rest(4));
  for (std::size_t s = 0; s < 4; ++s) {
    const Joint &a = same.segments[s].joint, &b = rig.skeleton.segments[s].joint;
    EXPECT_LT((a.center - b.center).norm(), 1e-12);
    EXPECT_LT((a.axes - b.axes).norm(), 1e-12);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(a.sequence[k].rest, b.sequence[k].rest, 1e-12);
  }
}

TEST(PosedRest, RoundingDoesNotLeaveTheLimits) {
  Rig rig = test::chain(2);
  AngleAxis& flexion = rig.skeleton.segments[1].joint.sequence[0];
  flexion.min = 0;
  flexion.max = 1.234567;
  Pose pose = Pose::rest(2);
  pose.rotation[1] = rotation_from_angles(rig.skeleton.segments[1].joint, {1.234567 + 1e-12, 0, 0});
  EXPECT_EQ(posed_rest(rig, pose).segments[1].joint.sequence[0].rest, 1.234567);
}

}  // namespace
}  // namespace ecorche::kinematics
