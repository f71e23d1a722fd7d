// SPDX-License-Identifier: Apache-2.0
// Two motions of one take: turns that stay, rooms, and beginnings that are not the same.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/kinematics/mean_turn.hpp"
#include "core/kinematics/motion_compare.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kRadiansADegree = std::numbers::pi / 180;

TEST(MotionCompare, ConstantTurnsAreToldFromOthers) {
  const Rig rig = test::legs();
  const auto one = [&](std::size_t frame) {
    Pose p = Pose::rest(7);
    p.rotation[1] = test::turn(Vector3d::UnitX(), 0.01 * static_cast<double>(frame));
    return p;
  };
  // Twice as many frames; the left hip turned by 20 degrees throughout.
  const auto other = [&](std::size_t frame) {
    Pose p = Pose::rest(7);
    p.rotation[1] = test::turn(Vector3d::UnitX(), 0.005 * static_cast<double>(frame)) *
                    test::turn(Vector3d::UnitY(), 20 * kRadiansADegree);
    return p;
  };
  const MotionDifference apart = compare(rig, {50, 0.02, one}, {100, 0.01, other});
  EXPECT_EQ(apart.shift_seconds, 0) << "an even turn tells no shift from a constant one";
  EXPECT_EQ(apart.joints[1].joint, "thigh_left_joint");
  EXPECT_NEAR(apart.joints[1].mean, 20 * kRadiansADegree, 1e-9);
  EXPECT_NEAR(apart.joints[1].worst, 20 * kRadiansADegree, 1e-9);
  EXPECT_NEAR(apart.joints[1].varying, 0, 1e-7);
  EXPECT_EQ(apart.joints[2].mean, 0);
}

// The publisher of one take had the person walk another way; where he leans is no matter of that.
TEST(MotionCompare, AnotherRoomIsNoDifference) {
  Rig rig = test::legs();
  rig.skeleton.segments[0].joint.axes = test::turn(Vector3d(1, 2, 3), 0.8).toRotationMatrix();
  const Quaterniond frame(rig.skeleton.segments[0].joint.axes);
  const auto walk = [&](double heading, double lean, std::size_t number) {
    Pose p = Pose::rest(7);
    const double at = 0.3 * std::sin(0.4 * static_cast<double>(number));
    const Quaterniond turn = test::turn(Vector3d::UnitZ(), heading) *
                             test::turn(Vector3d::UnitX(), lean + at) * test::turn(Vector3d::UnitY(), at);
    p.rotation[0] = frame.conjugate() * turn * frame;
    return p;
  };
  const PoseTrack plain{50, 0.02, [&](std::size_t f) { return walk(0, 0, f); }};
  for (const double heading : {1.1, -2.9}) {
    const auto apart = compare(rig, plain, {50, 0.02, [&](std::size_t f) { return walk(heading, 0, f); }});
    EXPECT_LT(apart.joints[0].worst, 1e-7) << heading;
  }
  const auto leans = compare(rig, plain, {50, 0.02, [&](std::size_t f) { return walk(1.1, 0.2, f); }});
  EXPECT_NEAR(leans.joints[0].mean, 0.2, 0.03);
}

// A knee that swings as a sine. The second maker cut the take so much later, and records at another pace.
Pose swinging(double seconds) {
  Pose p = Pose::rest(7);
  p.rotation[2] = test::turn(Vector3d::UnitX(), 0.7 * std::sin(2 * std::numbers::pi * seconds));
  return p;
}

TEST(MotionCompare, ATakeThatBeginsAFrameLaterIsFound) {
  const Rig rig = test::legs();
  const PoseTrack one{60, 1.0 / 60, [&](std::size_t f) { return swinging(static_cast<double>(f) / 60); }};
  for (const double shift : {-2.0 / 60, -1.0 / 120, 0.0, 1.0 / 120, 2.0 / 120, 2.0 / 60}) {
    const PoseTrack other{120, 1.0 / 120,
                          [&](std::size_t f) { return swinging(static_cast<double>(f) / 120 - shift); }};
    const MotionDifference apart = compare(rig, one, other);
    EXPECT_NEAR(apart.shift_seconds, shift, 1e-9);
    EXPECT_LT(apart.joints[2].mean, 1e-4);
  }
  // Farther than two frames is another take.
  const PoseTrack far{60, 1.0 / 60,
                      [&](std::size_t f) { return swinging(static_cast<double>(f) / 60 - 0.2); }};
  EXPECT_LE(std::abs(compare(rig, one, far).shift_seconds), 2.0 / 60 + 1e-9);
  EXPECT_GT(compare(rig, one, far).joints[2].mean, 0.2);
}

// Another joint that only one of them moves hides nothing, and no shift makes it better.
TEST(MotionCompare, AShiftThatMendsNothingIsNotTaken) {
  const Rig rig = test::legs();
  const PoseTrack one{60, 1.0 / 60, [&](std::size_t f) {
                        Pose p = swinging(static_cast<double>(f) / 60);
                        p.rotation[2] = Quaterniond::Identity().slerp(0.02, p.rotation[2]);
                        return p;
                      }};
  const PoseTrack other{60, 1.0 / 60, [&](std::size_t f) {
                          Pose p = one.pose(f);
                          p.rotation[4] =
                              test::turn(Vector3d::UnitX(), 0.3 * std::sin(0.1 * static_cast<double>(f)));
                          return p;
                        }};
  EXPECT_EQ(compare(rig, one, other).shift_seconds, 0);
}

TEST(MeanTurn, TheSignOfAQuaternionIsNoTurn) {
  const auto q = [](double angle) { return test::turn(Vector3d(1, 2, 3), angle); };
  MeanTurn mean;
  mean.add(q(1.0));
  mean.add(Quaterniond(-q(1.2).coeffs()));
  EXPECT_LT(mean.mean().angularDistance(q(1.1)), 1e-7);
  EXPECT_EQ(MeanTurn().mean().coeffs(), Quaterniond::Identity().coeffs());
}

TEST(MotionCompare, OnlyFramesThatBothHaveCount) {
  const Rig rig = test::legs();
  const PoseTrack one{60, 1.0 / 60, [&](std::size_t f) {
                        return f < 30 ? swinging(static_cast<double>(f) / 60) : Pose::rest(7);
                      }};
  const PoseTrack half{30, 1.0 / 60, [&](std::size_t f) {
                         EXPECT_LT(f, 30U);
                         return swinging(static_cast<double>(f) / 60);
                       }};
  EXPECT_EQ(compare(rig, one, half).joints[2].mean, 0);
}

}  // namespace
}  // namespace ecorche::kinematics
