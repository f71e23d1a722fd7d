// SPDX-License-Identifier: Apache-2.0
// Left bones that lie on the right of the body.
#include <gtest/gtest.h>

#include <numbers>

#include "preprocess/rig/exchanged_sides.hpp"
#include "tests/unit/rig/human_bodies.hpp"

namespace ecorche::rig {
namespace {

using Names = std::set<std::string>;

const std::vector<CaseBone>& whole_body() {
  static const std::vector<CaseBone> made = test::phantom_bones(
      {"pelvis", "lumbar", "thorax", "neck", "head", "jaw", "girdle_left", "upper_arm_left", "forearm_left",
       "hand_left", "thigh_left", "shank_left", "foot_left", "toes_left"},
      6);
  return made;
}

const Names kAll{"girdle_left",  "girdle_right",  "upper_arm_left", "upper_arm_right",
                 "forearm_left", "forearm_right", "hand_left",      "hand_right",
                 "thigh_left",   "thigh_right",   "shank_left",     "shank_right",
                 "foot_left",    "foot_right",    "toes_left",      "toes_right"};

// The bones of the segments that begin so have the other side's names.
Case exchanged(const std::string& begin, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
  std::vector<CaseBone> bones = whole_body();
  for (CaseBone& bone : bones) {
    bone.surface.V = bone.surface.V * turn.transpose();
    const std::string other = other_side(bone.segment);
    if (!other.empty() && bone.segment.starts_with(begin)) bone.segment = other;
  }
  return test::human_case(bones);
}

TEST(Sides, of_a_body_as_it_is_are_right_however_it_lies) {
  for (const Eigen::Vector3d& about :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 2, -0.5)}) {
    for (const double degrees : {0.0, 25.0, 90.0, 180.0}) {
      const Eigen::Matrix3d turn =
          Eigen::AngleAxisd(degrees * std::numbers::pi / 180, about.normalized()).toRotationMatrix();
      EXPECT_EQ(exchanged_sides(exchanged("none", turn)), Names())
          << degrees << " about " << about.transpose();
      EXPECT_EQ(exchanged_sides(exchanged("", turn)), kAll) << degrees << " about " << about.transpose();
    }
  }
}

TEST(Sides, crossed_legs_are_no_exchanged_ones) {
  Case patient = exchanged("none");
  for (CaseBone& bone : patient.bones) {
    const double side = bone.segment.ends_with("_left") ? 1 : -1;
    if (!bone.segment.starts_with("shank") && !bone.segment.starts_with("foot") &&
        !bone.segment.starts_with("toes"))
      continue;
    // About the knee, so that each foot comes to lie on the other side.
    const Eigen::RowVector3d knee(side * 88, 0, 485);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(side * 25 * std::numbers::pi / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
    bone.surface.V = ((bone.surface.V.rowwise() - knee) * turn.transpose()).rowwise() + knee;
    if (bone.segment == "foot_left") {
      EXPECT_LT(bone.surface.V.col(0).mean(), -20);
    }
  }
  EXPECT_EQ(exchanged_sides(patient), Names());
}

TEST(Sides, other_skeletons_say_nothing) {
  Case patient = exchanged("");
  patient.skeleton.name = "my_own";
  EXPECT_EQ(exchanged_sides(patient), Names());
}

TEST(Sides, exchanged_femurs_are_told_once_and_nothing_that_rests_on_them_is_sure) {
  const test::Found was = test::found(exchanged("none"));
  const Case patient = exchanged("thigh");
  EXPECT_EQ(exchanged_sides(patient), (Names{"thigh_left", "thigh_right"}));
  const test::Found now = test::found(patient);
  EXPECT_EQ(std::count_if(now.warnings.begin(), now.warnings.end(),
                          [](const std::string& line) { return line.starts_with("sides: "); }),
            1);
  for (const char* joint : {"pelvis", "hip_left", "knee_right", "thoracolumbar", "shoulder_left"})
    EXPECT_LT(now.confidence(joint), 0.5) << joint;
  EXPECT_EQ(now.confidence("elbow_left"), was.confidence("elbow_left")) << "it rests on none of them";
  // The pelvis is not turned about, and the limits stay as they were.
  EXPECT_GT(now.joint("pelvis").axes.col(0).x(), 0.99);
  const auto &is = now.joint("shoulder_left").sequence, &before = was.joint("shoulder_left").sequence;
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_NEAR(is[a].max, before[a].max, 1e-6);
    EXPECT_NEAR(is[a].min, before[a].min, 1e-6);
  }
}

TEST(Sides, a_body_with_all_of_them_exchanged_is_not_turned_back_to_front) {
  const test::Found was = test::found(exchanged("none"));
  const test::Found now = test::found(exchanged(""));
  EXPECT_GT(now.joint("pelvis").axes.col(0).x(), 0.99);
  EXPECT_GT(now.joint("knee_left").axes.col(0).x(), 0.9);
  EXPECT_LT((now.joint("knee_left").center - was.joint("knee_right").center).norm(), 3);
  for (const Segment& segment : now.rig.skeleton.segments) {
    if (segment.name == "jaw") continue;
    EXPECT_LT(now.confidence(segment.joint.name), 0.5) << segment.joint.name;
  }
}

}  // namespace
}  // namespace ecorche::rig
