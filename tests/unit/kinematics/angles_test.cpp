// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/angles.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include <ecorche/values/error.hpp>
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Angles = std::array<double, 3>;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::sequence;
using test::turn;
constexpr double kPi = std::numbers::pi;

Joint joint_of(JointKind kind, std::vector<AngleAxis> turns) {
  Joint joint;
  joint.name = "knee";
  joint.kind = kind;
  joint.sequence = std::move(turns);
  return joint;
}

double apart(const Quaterniond& a, const Quaterniond& b) {
  return a.angularDistance(b);
}

// All six sequences with all eight sign triples, some at a rest pose of their own.
template <class F>
void for_all_sequences(F f) {
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int bits = 0; bits < 8; ++bits) {
      const Angles signs{bits & 1 ? -1.0 : 1.0, bits & 2 ? -1.0 : 1.0, bits & 4 ? -1.0 : 1.0};
      f(joint_of(JointKind::ball, sequence(axes, signs)));
      f(joint_of(JointKind::ball, sequence(axes, signs, {0.3, -0.2, 0.5})));
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
}

TEST(Angles, OneAngleIsATurnAboutItsAxis) {
  const Joint joint = joint_of(JointKind::ball, sequence({2, 0, 1}, {1, -1, 1}));
  EXPECT_LT(apart(rotation_from_angles(joint, {0.4, 0, 0}), turn(Vector3d::UnitZ(), 0.4)), 1e-12);
  EXPECT_LT(apart(rotation_from_angles(joint, {0, 0.4, 0}), turn(Vector3d::UnitX(), -0.4)), 1e-12);
  const Quaterniond both =
      turn(Vector3d::UnitZ(), 0.4) * turn(Vector3d::UnitX(), -0.3) * turn(Vector3d::UnitY(), 0.2);
  EXPECT_LT(apart(rotation_from_angles(joint, {0.4, 0.3, 0.2}), both), 1e-12);
}

TEST(Angles, RestPoseHasTheRestAngles) {
  for_all_sequences([](const Joint& joint) {
    const Angles rest{joint.sequence[0].rest, joint.sequence[1].rest, joint.sequence[2].rest};
    EXPECT_LT(apart(rotation_from_angles(joint, rest), Quaterniond::Identity()), 1e-12);
    const Angles found = angles_from_rotation(joint, Quaterniond::Identity());
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], rest[i], 1e-12);
  });
}

TEST(Angles, RoundTripOfRotations) {
  std::mt19937 random(7);
  for_all_sequences([&](const Joint& joint) {
    for (int trial = 0; trial < 50; ++trial) {
      const Quaterniond q = test::random_turn(random);
      const Angles angles = angles_from_rotation(joint, q);
      EXPECT_LE(std::abs(angles[1]), kPi / 2 + 1e-12);
      EXPECT_LT(apart(rotation_from_angles(joint, angles), q), 1e-9);
    }
  });
}

TEST(Angles, RoundTripOfAngles) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> whole(-kPi + 0.01, kPi - 0.01),
      half(-kPi / 2 + 0.01, kPi / 2 - 0.01);
  for_all_sequences([&](const Joint& joint) {
    for (int trial = 0; trial < 50; ++trial) {
      const Angles asked{whole(random), half(random), whole(random)};
      const Angles found = angles_from_rotation(joint, rotation_from_angles(joint, asked));
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], asked[i], 1e-9);
    }
  });
}

TEST(Angles, GimbalLockKeepsTheThirdAtRest) {
  for_all_sequences([](const Joint& joint) {
    for (const double quarter : {-kPi / 2, kPi / 2}) {
      const Quaterniond q = rotation_from_angles(joint, {0.7, quarter, 0.4});
      const Angles found = angles_from_rotation(joint, q);
      EXPECT_NEAR(found[1], quarter, 1e-6);
      EXPECT_EQ(found[2], joint.sequence[2].rest);
      EXPECT_LT(apart(rotation_from_angles(joint, found), q), 1e-6);
    }
  });
}

TEST(Angles, RefusesASequenceThatRepeatsAnAxis) {
  const Joint joint = joint_of(JointKind::ball, sequence({0, 1, 0}));
  EXPECT_THROW(rotation_from_angles(joint, {0, 0, 0}), Error);
  EXPECT_THROW(angles_from_rotation(joint, Quaterniond::Identity()), Error);
  EXPECT_THROW(clamp(joint_of(JointKind::hinge, {}), Quaterniond::Identity()), Error);
}

TEST(Clamp, BallWithinItsLimitsComesBackBitByBit) {
  std::mt19937 random(9);
  Joint joint = joint_of(JointKind::ball, sequence({2, 0, 1}, {-1, 1, 1}, {0.1, 0.2, 0.3}));
  const Quaterniond far = test::random_turn(random);
  EXPECT_EQ(clamp(joint, far).coeffs(), far.coeffs()) << "no limit";
  for (AngleAxis& angle : joint.sequence) {
    angle.min = -1;
    angle.max = 1;
  }
  std::uniform_real_distribution<double> inside(-0.99, 0.99);
  for (int trial = 0; trial < 100; ++trial) {
    const Quaterniond q = rotation_from_angles(joint, {inside(random), inside(random), inside(random)});
    EXPECT_EQ(clamp(joint, q).coeffs(), q.coeffs());
  }
  EXPECT_EQ(clamp(joint, Quaterniond::Identity()).coeffs(), Quaterniond::Identity().coeffs());
}

TEST(Clamp, BallStopsEachAngleAtItsLimit) {
  Joint joint = joint_of(JointKind::ball, sequence({2, 0, 1}, {1, -1, 1}));
  joint.sequence[0].min = -0.5;
  joint.sequence[0].max = 0.6;
  joint.sequence[1].min = -0.2;
  joint.sequence[1].max = 0.3;
  const Quaterniond done = clamp(joint, rotation_from_angles(joint, {0.9, -0.7, 1.1}));
  EXPECT_LT(apart(done, rotation_from_angles(joint, {0.6, -0.2, 1.1})), 1e-9);
}

TEST(Clamp, TheOtherTripleOfOneRotationCounts) {
  // A middle angle may be allowed beyond 90 degrees, where the angles are told by the other triple.
  Joint joint = joint_of(JointKind::ball, sequence({2, 0, 1}, {1, -1, 1}));
  for (AngleAxis& angle : joint.sequence) angle.min = angle.max = 0;
  joint.sequence[1].max = 2.5;
  const Quaterniond raised = rotation_from_angles(joint, {0, 2.2, 0});
  EXPECT_EQ(clamp(joint, raised).coeffs(), raised.coeffs());
  const Quaterniond too_far = rotation_from_angles(joint, {0, 2.8, 0});
  EXPECT_LT(apart(clamp(joint, too_far), rotation_from_angles(joint, {0, 2.5, 0})), 1e-9);
}

TEST(Clamp, LimitsNeverRefuseTheScan) {
  Joint joint = joint_of(JointKind::ball, sequence({0, 1, 2}, {1, 1, 1}, {0.4, 0, 0}));
  joint.sequence[0].min = -0.1;
  joint.sequence[0].max = 0.1;
  EXPECT_LT(apart(clamp(joint, Quaterniond::Identity()), Quaterniond::Identity()), 1e-15);
  EXPECT_LT(apart(clamp(joint, rotation_from_angles(joint, {0.6, 0, 0})), Quaterniond::Identity()), 1e-9);
}

TEST(Clamp, HingeKeepsTheTwistAboutItsAxis) {
  std::mt19937 random(10);
  const Joint joint = joint_of(JointKind::hinge, sequence({1, 0, 2}, {-1, 1, 1}));
  for (int trial = 0; trial < 100; ++trial) {
    const Quaterniond q = test::random_turn(random);
    const Quaterniond done = clamp(joint, q);
    EXPECT_LT(std::hypot(done.x(), done.z()), 1e-12);
    // The nearest of all turns about the axis: 1-degree steps find none that is nearer.
    for (int degree = 0; degree < 360; degree += 1) {
      EXPECT_GE(apart(q, turn(Vector3d::UnitY(), degree * kPi / 180)), apart(q, done) - 1e-9);
    }
  }
  const Quaterniond pure = turn(Vector3d::UnitY(), 1.2);
  EXPECT_LT(apart(clamp(joint, pure), pure), 1e-12);
  const Quaterniond sideways = turn(Vector3d::UnitX(), 1.2);
  EXPECT_LT(apart(clamp(joint, sideways), Quaterniond::Identity()), 1e-12);
}

TEST(Clamp, HingeStopsAtItsLimitsAboutItsRestAngle) {
  Joint joint = joint_of(JointKind::hinge, sequence({0, 1, 2}, {-1, 1, 1}, {0.2, 0.1, -0.3}));
  joint.sequence[0].min = -0.1;
  joint.sequence[0].max = 2;
  const auto flexed = [&](double a) { return rotation_from_angles(joint, {a, 0.1, -0.3}); };
  EXPECT_LT(apart(clamp(joint, flexed(1.5)), flexed(1.5)), 1e-12);
  EXPECT_LT(apart(clamp(joint, flexed(2.5)), flexed(2)), 1e-12);
  EXPECT_LT(apart(clamp(joint, flexed(-0.5)), flexed(-0.1)), 1e-12);
}

TEST(Clamp, HingeBeyondHalfATurnIsReadModuloWholeTurns) {
  Joint joint = joint_of(JointKind::hinge, sequence({0, 1, 2}));
  joint.sequence[0].min = 0;
  joint.sequence[0].max = 240 * kPi / 180;
  const Quaterniond q = turn(Vector3d::UnitX(), 230 * kPi / 180);
  EXPECT_LT(apart(clamp(joint, q), q), 1e-12);
  const Quaterniond past = turn(Vector3d::UnitX(), 250 * kPi / 180);
  EXPECT_LT(apart(clamp(joint, past), turn(Vector3d::UnitX(), 240 * kPi / 180)), 1e-9);
}

TEST(Clamp, UniversalKeepsTwoAngles) {
  Joint joint = joint_of(JointKind::universal, sequence({0, 1, 2}, {1, -1, 1}, {0, 0, 0.2}));
  joint.sequence[1].max = 0.3;
  const Quaterniond done = clamp(joint, rotation_from_angles(joint, {0.5, 0.8, 0.9}));
  EXPECT_LT(apart(done, rotation_from_angles(joint, {0.5, 0.3, 0.2})), 1e-9);
}

TEST(Clamp, FixedDoesNotTurn) {
  EXPECT_EQ(clamp(joint_of(JointKind::fixed, {}), turn(Vector3d::UnitX(), 1)).coeffs(),
            Quaterniond::Identity().coeffs());
}

}  // namespace
}  // namespace ecorche::kinematics
