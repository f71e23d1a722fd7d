// SPDX-License-Identifier: Apache-2.0
// Joints that cannot be, and a body of a size that none has: the knee of README.md, wrong in one way at a
// time.
#include "preprocess/check/joints.hpp"

#include <gtest/gtest.h>

#include <ecorche/values/error.hpp>
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

Case knee() {
  Case patient;
  patient.name = "my_patient";
  patient.skeleton.name = "knee";
  Segment thigh, shank;
  thigh.name = "thigh_right";
  thigh.joint.name = "hip_right";
  thigh.joint.center = {-88, 0, 905};
  thigh.joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
  shank.name = "shank_right";
  shank.parent = 0;
  shank.joint.name = "knee_right";
  shank.joint.kind = JointKind::hinge;
  shank.joint.center = {-88, 0, 485};
  shank.joint.sequence = {
      {.name = "flexion", .axis = 0}, {.name = "adduction", .axis = 1}, {.name = "rotation", .axis = 2}};
  patient.skeleton.segments = {thigh, shank};
  patient.skin = box({-150, -80, 0}, {-30, 80, 1000});
  patient.bones = {{"femur_right", "thigh_right", box({-103, -15, 490}, {-73, 15, 920})},
                   {"tibia_right", "shank_right", box({-103, -15, 60}, {-73, 15, 480})}};
  return patient;
}

void move(Case& patient, const Vector3d& by) {
  patient.skin.V.rowwise() += by.transpose();
  for (CaseBone& bone : patient.bones) bone.surface.V.rowwise() += by.transpose();
}

std::vector<Finding> joints_of(const Case& patient) {
  return joint_findings(patient, rig::fit(patient, {}), Inside(patient.skin), {});
}

#define EXPECT_HOLDS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

TEST(JointChecks, a_knee_at_its_bones_is_right_wherever_its_hip_is) {
  Case patient = knee();
  EXPECT_TRUE(joints_of(patient).empty());
  patient.skeleton.segments[0].joint.center.z() = 1100;  // a scan that ends below it
  EXPECT_TRUE(joints_of(patient).empty());
}

TEST(JointChecks, a_joint_deep_in_its_bone_is_right_where_the_skin_is_cut) {
  Case patient = knee();
  patient.skin = box({-150, -80, 530}, {-30, 80, 1000});
  patient.skeleton.segments[1].joint.center = {-88, 0, 505};  // 15 mm below the femur's surfaces
  EXPECT_TRUE(joints_of(patient).empty());
  patient.skeleton.segments[1].joint.center = {-62, 0, 505};  // 11 mm beside it
  EXPECT_EQ(joints_of(patient).size(), 1u);
}

TEST(JointChecks, a_body_in_another_frame_than_its_skeleton) {
  Case patient = knee();
  move(patient, {176, 0, 0});
  const auto found = joints_of(patient);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].where, "joint knee_right");
  EXPECT_EQ(found[0].severity, Severity::error);
  EXPECT_EQ(found[0].what,
            "its center [-88.0, 0.0, 485.0] lies 114 mm outside the skin, 161 mm from the bones of "
            "'shank_right' and 161 mm from those of 'thigh_right'");
  EXPECT_HOLDS(found[0].mend,
               "with x and y negated it would lie at its bones: the skeleton's centers are in another frame");
  EXPECT_EQ(*found[0].at, Vector3d(-88, 0, 485));
}

TEST(JointChecks, a_body_that_lies_elsewhere_is_told_where_its_bones_meet) {
  Case patient = knee();
  move(patient, {60, 300, 0});
  const auto found = joints_of(patient);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_HOLDS(found[0].mend, "the bones come nearest to each other at [");
  EXPECT_HOLDS(found[0].mend, "485.0]: say its center there, or give it a rule that finds it");
}

TEST(JointChecks, a_skeleton_in_another_unit) {
  Case patient = knee();
  for (Segment& segment : patient.skeleton.segments) segment.joint.center *= 1000;
  const auto found = joints_of(patient);
  ASSERT_EQ(found.size(), 2u);  // the hip, the root here, too lies beyond twice the body
  EXPECT_HOLDS(found[0].mend, "made 1000 times smaller it would lie at its bones");
  EXPECT_HOLDS(found[1].what, "[-88000.0, 0.0, 485000.0]");
  EXPECT_HOLDS(found[1].mend, "made 1000 times smaller it would lie at its bones");
  EXPECT_HOLDS(found[1].mend, "unit: stands at the case");
}

TEST(JointChecks, exchanged_segments) {
  Case patient = knee();
  std::swap(patient.bones[0].segment, patient.bones[1].segment);
  const auto found = joints_of(patient);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].what,
            "the joints of 'thigh_right' and 'shank_right' lie 425 mm from their bones, and 15 mm were those "
            "bones exchanged");
  EXPECT_EQ(found[0].mend, "exchange the segments of their bones");
}

TEST(JointChecks, a_hinge_about_a_shaft) {
  Case patient = knee();
  Joint& joint = patient.skeleton.segments[1].joint;
  joint.axes = Eigen::AngleAxisd(1.2, Vector3d::UnitY()).toRotationMatrix();
  const auto found = joints_of(patient);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_HOLDS(
      found[0].what,
      "degrees to the shaft of 'shank_right': no hinge that flexes turns a bone about its own shaft");
  EXPECT_EQ(found[0].mend, "give it axes that stand across both bones");
  joint.sequence[0].name = "pronation";  // that one may
  EXPECT_TRUE(joints_of(patient).empty());
}

TEST(JointChecks, a_human_in_metres_taken_for_millimetres) {
  Case patient = knee();
  const io::PlacedSkeleton human = io::parse_skeleton(
      io::yaml::Value::parse(io::skeleton_template("human").value(), "human.yaml"), io::Frame{});
  patient.skeleton = human.skeleton;
  patient.size = human.size;
  EXPECT_TRUE(size_findings(patient).empty());
  patient.skin.V *= 0.001;
  const auto found = size_findings(patient);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].where, "size");
  EXPECT_EQ(found[0].what, "the body is 1 mm long, one for the skeleton 'human' is 40 mm to 3000 mm");
  EXPECT_EQ(found[0].mend, "with unit: m in place of mm it would be 1000 mm");
  patient.skin.V *= 1e6;
  EXPECT_EQ(size_findings(patient).at(0).mend, "with unit: um in place of mm it would be 1000 mm");
  patient.skin.V *= 0.01;
  EXPECT_EQ(size_findings(patient).at(0).mend,
            "made 10 times smaller it would be 1000 mm: mend unit: of the case, or of its files");
}

TEST(JointChecks, inspection_gathers_them_and_preparing_refuses) {
  Case patient = knee();
  Report report;
  inspect_joints(patient, {}, report);
  EXPECT_TRUE(report.possible());
  patient.skeleton.segments[1].joint.center.x() = 500;
  inspect_joints(patient, {}, report);
  EXPECT_FALSE(report.possible());
  report.findings.push_back({Severity::error, "elsewhere", "too", {}, ""});
  try {
    refuse(report.findings);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    EXPECT_EQ(error.where(), "joint knee_right");
    EXPECT_HOLDS(error.mend(), "; ecorche check names 1 more");
  }
}

}  // namespace
}  // namespace ecorche::check
