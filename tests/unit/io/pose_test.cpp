// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include <ecorche/io/case_file.hpp>
#include <ecorche/kinematics/angles.hpp>
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/io/small_case.hpp"

namespace ecorche::io {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// The small skeleton with a sliding patella.
Rig rig() {
  Rig out;
  out.skeleton = small_skeleton();
  Segment patella;
  patella.name = "patella_right";
  patella.parent = 1;
  patella.joint.name = "patella_right";
  patella.joint.kind = JointKind::free;
  patella.joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
  out.skeleton.segments.push_back(patella);
  return out;
}

class PoseFile : public ::testing::Test {
 protected:
  Pose read(const std::string& text) { return read_pose(scratch_.put("pose.yaml", text), rig()); }
  void refused(const std::string& text, const std::string& part) {
    expect_error(ErrorKind::config, "/pose.yaml:" + part, [&] { read(text); });
  }
  Scratch scratch_;
  const std::string head_ = "ecorche_pose: 1\nskeleton: small\n";
};

TEST_F(PoseFile, ReadsBackExactly) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  Pose pose = Pose::rest(3);
  pose.root_translation = {1.0 / 3, -1e-9, 1234.5};
  for (auto& q : pose.rotation)
    q = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
  pose.translation[2] = {0.1, 0.2, 0.3};
  const Pose back = read(pose_to_yaml(pose, rig()));
  EXPECT_EQ(back.root_translation, pose.root_translation);
  EXPECT_EQ(back.translation, pose.translation);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(back.rotation[i].coeffs(), pose.rotation[i].coeffs());
}

TEST_F(PoseFile, AnEmptyPoseIsTheScan) {
  const Pose pose = read(head_);
  ASSERT_EQ(pose.rotation.size(), 3u);
  for (const auto& q : pose.rotation) EXPECT_EQ(q.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(pose.root_translation, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(pose_to_yaml(pose, rig()).find("joints"), std::string::npos);
}

// By hand: the hip rests at 0.2 rad of flexion about x; 90 degrees is a turn by what is left.
TEST_F(PoseFile, AnglesAreAnatomicalAndAbsolute) {
  const Pose pose = read(head_ + "joints: {hip_right: {flexion_deg: 90}}\n");
  const Eigen::Quaterniond expected(Eigen::AngleAxisd(90 * kDegree - 0.2, Eigen::Vector3d::UnitX()));
  EXPECT_LT(pose.rotation[1].angularDistance(expected), 1e-12);
  // A positive adduction is the negative turn about y; flexion stays at rest.
  const Pose side = read(head_ + "joints: {hip_right: {adduction_deg: 30}}\n");
  const auto angles = kinematics::angles_from_rotation(rig().skeleton.segments[1].joint, side.rotation[1]);
  EXPECT_NEAR(angles[0], 0.2, 1e-12);
  EXPECT_NEAR(angles[1], 30 * kDegree, 1e-12);
  EXPECT_NEAR(angles[2], 0, 1e-12);
  // Beyond the limit: accepted here.
  EXPECT_NO_THROW(read(head_ + "joints: {hip_right: {flexion_deg: 170}}\n"));
}

TEST_F(PoseFile, EveryMistakeIsNamed) {
  refused("ecorche_pose: 2\nskeleton: small\n", "1:ecorche_pose: version '2' is not known");
  refused("ecorche_pose: 1\nskeleton: other\n",
          "2:skeleton: this pose is for the skeleton 'other', the model has 'small'");
  refused(head_ + "joint: {}\n", "3:joint: unknown key 'joint' (did you mean 'joints'?)");
  refused(head_ + "joints: {hip_rihgt: {flexion_deg: 3}}\n",
          "3:joints.hip_rihgt: unknown joint 'hip_rihgt' (did you mean 'hip_right'?)");
  refused(head_ + "joints: {hip_rihgt: {flexion_deg: 3}}\n",
          "3:joints.hip_rihgt: unknown joint 'hip_rihgt' (did you mean 'hip_right'?)");
  refused(head_ + "joints:\n  hip_right: {flexion: 3}\n",
          "4:joints.hip_right.flexion: unknown key 'flexion'");
  refused(head_ + "joints: {hip_right: {flexion_deg: x}}\n",
          "3:joints.hip_right.flexion_deg: must be a number, is 'x'");
  refused(head_ + "joints: {hip_right: {rotation: [1, 0, 0]}}\n",
          "3:joints.hip_right.rotation: has 3 values (write 4 numbers)");
  refused(head_ + "joints: {hip_right: {rotation: [1, 1, 0, 0]}}\n",
          "3:joints.hip_right.rotation: is a quaternion of length 1.414");
  refused(head_ + "joints: {hip_right: {rotation: [0, 0, 0, 0]}}\n",
          "3:joints.hip_right.rotation: is a quaternion of length 0");
  refused(head_ + "joints: {hip_right: {rotation: [1, 0, 0, 0], flexion_deg: 3}}\n",
          "3:joints.hip_right: gives a rotation and angles");
  refused(head_ + "joints: {hip_right: {translation_mm: [1, 0, 0]}}\n",
          "3:joints.hip_right.translation_mm: 'hip_right' cannot move away from its parent (only free joints "
          "have a translation)");
  refused(head_ + "joints: {root: {translation_mm: [1, 0, 0]}}\n",
          "3:joints.root.translation_mm: 'root' cannot move away from its parent (write root: "
          "{translation_mm: [x, y, z]})");
  refused(head_ + "root: {rotation: [1, 0, 0, 0]}\njoints: {root: {rotation: [1, 0, 0, 0]}}\n",
          "4:joints.root: the root is turned twice");
  refused(head_ + "root: {move: 3}\n", "3:root.move: unknown key 'move' (use translation_mm, rotation)");
  expect_error(ErrorKind::missing_input, "none.yaml", [] { read_pose("none.yaml", rig()); });
}

TEST_F(PoseFile, EveryPrefixFailsCleanly) {
  Pose pose = Pose::rest(3);
  pose.rotation[1] = Eigen::Quaterniond(0, 1, 0, 0);
  const std::string whole = pose_to_yaml(pose, rig());
  for (std::size_t n = 0; n < whole.size(); n += 2) {
    try {
      read(whole.substr(0, n));
    } catch (const Error& error) {
      ASSERT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::config)) << error.what();
    }
  }
}

}  // namespace
}  // namespace ecorche::io
