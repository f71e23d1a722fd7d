// SPDX-License-Identifier: Apache-2.0
// A body that lies askew in its scan has the joints of a straight one, askew.
#include <gtest/gtest.h>

#include <numbers>

#include "preprocess/rig/body_frame.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const std::vector<CaseBone>& body() {
  static const std::vector<CaseBone> made = test::phantom_bones(
      {"pelvis", "lumbar", "thorax", "neck", "head", "jaw", "girdle_left", "upper_arm_left", "forearm_left",
       "hand_left", "thigh_left", "shank_left", "foot_left", "toes_left"},
      6);
  return made;
}

std::vector<CaseBone> askew(const Matrix3d& turn) {
  std::vector<CaseBone> bones = body();
  for (CaseBone& bone : bones) bone.surface.V = bone.surface.V * turn.transpose();
  return bones;
}

Matrix3d turn_by(double degrees, const Vector3d& about) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized()).toRotationMatrix();
}

double degrees_of(const Matrix3d& turn) {
  return Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi;
}

void expect_turned(const test::Found& straight, const test::Found& now, const Matrix3d& turn) {
  for (const Segment& segment : straight.rig.skeleton.segments) {
    const std::string& name = segment.joint.name;
    const Joint& joint = now.joint(name);
    EXPECT_LT((joint.center - turn * segment.joint.center).norm(), 0.1)
        << name << " turned by " << degrees_of(turn);
    EXPECT_LT(degrees_of(joint.axes.transpose() * turn * segment.joint.axes), 0.1)
        << name << " turned by " << degrees_of(turn);
  }
}

TEST(BodyFrame, is_that_of_the_scan_where_the_body_stands_straight_in_it) {
  const Matrix3d frame = body_frame(test::human_case(body()));
  EXPECT_LT(degrees_of(frame), 4);
  EXPECT_NEAR(frame(0, 0), 1, 1e-6) << "a symmetric body is not turned to a side";
}

TEST(BodyFrame, a_body_askew_has_the_same_joints_askew) {
  const test::Found straight = test::found(body());
  for (const double degrees : {25.0, 120.0}) {
    const Matrix3d turn = turn_by(degrees, {1, 2, -0.5});
    const test::Found now = test::found(askew(turn));
    EXPECT_EQ(now.warnings.size(), straight.warnings.size());
    expect_turned(straight, now, turn);
    for (const JointFit& fit : straight.rig.fits)
      EXPECT_NEAR(now.confidence(fit.joint), fit.confidence, 0.01) << fit.joint << " at " << degrees;
  }
}

TEST(BodyFrame, is_that_of_the_scan_where_the_trunk_is_not_whole_or_somebody_marked_the_scan) {
  const Matrix3d turn = turn_by(30, {0, 1, 0});
  const Case whole = test::human_case(askew(turn));
  EXPECT_LT(degrees_of(body_frame(whole).transpose() * turn), 4);
  Case part = whole;
  std::erase_if(part.bones, [](const CaseBone& bone) { return bone.segment == "girdle_right"; });
  EXPECT_TRUE(body_frame(part).isIdentity(0));
  Case unlike = whole;
  for (CaseBone& bone : unlike.bones) {
    if (bone.segment == "thorax") bone.surface.V.rowwise() += Eigen::RowVector3d(0, 400, -300);
  }
  EXPECT_TRUE(body_frame(unlike).isIdentity(0)) << "in no body lies a thorax there";
  Case own = whole;
  own.skeleton.name = "my_own";
  EXPECT_TRUE(body_frame(own).isIdentity(0));
  Case marked = whole;
  marked.regions.push_back({});
  marked.regions.back().boxes.emplace_back(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  EXPECT_TRUE(body_frame(marked).isIdentity(0));
}

TEST(BodyFrame, a_girdle_without_its_scapula_turns_nothing) {
  for (const std::string side : {"left", "right"}) {
    for (const double degrees : {0.0, 30.0}) {
      const Matrix3d turn = turn_by(degrees, {1, 2, -0.5});
      Case patient = test::human_case(askew(turn));
      std::erase_if(patient.bones, [&](const CaseBone& bone) { return bone.name == "scapula_" + side; });
      ASSERT_EQ(patient.bones.size(), body().size() - 1);
      EXPECT_LT(degrees_of(body_frame(patient).transpose() * turn), 5) << side << " at " << degrees;
    }
  }
  Case neither = test::human_case(body());
  std::erase_if(neither.bones, [](const CaseBone& bone) { return bone.name.starts_with("scapula"); });
  EXPECT_TRUE(body_frame(neither).isIdentity(0)) << "pelvis and thorax alone leave it free to turn";
}

TEST(BodyFrame, legs_alone_lie_as_their_pelvis_does) {
  const std::vector<CaseBone> legs = test::phantom_bones({"pelvis", "thigh_left", "shank_left"}, 6);
  const test::Found straight = test::found(legs);
  EXPECT_LT(degrees_of(body_frame(test::human_case(legs))), 10) << "the phantom's own pelvis leans otherwise";
  for (const double degrees : {10.0, 40.0}) {
    const Matrix3d turn = turn_by(degrees, {1, 2, -0.5});
    std::vector<CaseBone> bones = legs;
    for (CaseBone& bone : bones) bone.surface.V = bone.surface.V * turn.transpose();
    const test::Found now = test::found(bones);
    expect_turned(straight, now, turn);
  }
}

TEST(BodyFrame, a_pelvis_that_is_cut_or_lies_on_its_side_says_nothing) {
  const std::vector<CaseBone> whole = test::phantom_bones({"pelvis"}, 6);
  EXPECT_FALSE(body_frame(test::human_case(whole)).isIdentity(0));
  const auto cut = [&](auto&& keep) {
    std::vector<CaseBone> bones = whole;
    for (CaseBone& bone : bones) bone.surface = test::part_of(bone.surface, keep);
    return body_frame(test::human_case(bones));
  };
  double low = 1e9, high = -1e9;
  for (const CaseBone& bone : whole) {
    low = std::min(low, bone.surface.V.col(2).minCoeff());
    high = std::max(high, bone.surface.V.col(2).maxCoeff());
  }
  const double middle = 0.5 * (low + high);
  EXPECT_TRUE(cut([](const Vector3d& p) { return p.x() > 0; }).isIdentity(0));
  EXPECT_TRUE(cut([&](const Vector3d& p) { return p.z() > middle; }).isIdentity(0));
  EXPECT_TRUE(cut([&](const Vector3d& p) { return p.z() < middle; }).isIdentity(0));
  std::vector<CaseBone> lying = whole;
  for (CaseBone& bone : lying) bone.surface.V = bone.surface.V * turn_by(80, {0, 1, 0}).transpose();
  EXPECT_TRUE(body_frame(test::human_case(lying)).isIdentity(0));
  Case own = test::human_case(whole);
  own.skeleton.name = "my_own";
  EXPECT_TRUE(body_frame(own).isIdentity(0));
}

TEST(BodyFrame, what_is_given_stays_to_the_last_digit) {
  const Matrix3d turn = turn_by(20, {1, 1, 0});
  Case patient = test::human_case(askew(turn));
  Joint& elbow =
      patient.skeleton.segments[static_cast<std::size_t>(patient.skeleton.find_joint("elbow_left"))].joint;
  elbow.how.reset();
  elbow.rule = CenterRule::given;
  elbow.center = Vector3d(1.1, 2.2, 3.3);
  elbow.axes = turn_by(40, {0, 0, 1});
  const Joint given = elbow;
  const test::Found now = test::found(patient);
  EXPECT_EQ(now.joint("elbow_left").center, given.center);
  EXPECT_EQ(now.joint("elbow_left").axes, given.axes);
}

}  // namespace
}  // namespace ecorche::rig
