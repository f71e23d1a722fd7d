// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/retarget.hpp"

#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/values/error.hpp>
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Names = std::vector<std::string>;

// A clip of the named joints in a chain, at the offsets of test::chain, with random turns.
Clip clip_of(const Names& names, std::size_t frames, std::mt19937& random) {
  Clip clip;
  clip.name = "walk";
  for (std::size_t j = 0; j < names.size(); ++j) {
    clip.joints.push_back({names[j], static_cast<int>(j) - 1, Vector3d(0, 0, j == 0 ? 0 : 100)});
  }
  for (std::size_t f = 0; f < frames; ++f) {
    clip.root_position.emplace_back(10.0 * static_cast<double>(f), 5, 0);
    for (std::size_t j = 0; j < names.size(); ++j) clip.rotation.push_back(test::random_turn(random));
  }
  return clip;
}

TEST(Retarget, MatchesNamesJointsAndAliases) {
  std::mt19937 random(1);
  Rig rig = test::chain(4);
  rig.skeleton.segments[2].aliases = {"Left Up_Leg", "LeftThigh"};
  const Clip clip = clip_of({"mixamorig:S_0", "J1", "rig:leftupleg", "tail", "EndSite_tail"}, 1, random);
  const Retarget match_ = match(rig, clip);
  EXPECT_EQ(match_.clip_joint, (std::vector<int>{0, 1, 2, -1}));
  EXPECT_EQ(match_.unused_joints, Names{"tail"});
  EXPECT_EQ(match_.still_segments, Names{"s3"});
}

TEST(Retarget, ASegmentsOwnNameGoesBeforeAnotherOnesJoint) {
  std::mt19937 random(1);
  Rig rig = test::chain(2);
  rig.skeleton.segments[0].joint.name = "s1";  // a joint with the name of the next segment
  EXPECT_EQ(match(rig, clip_of({"x", "s1"}, 1, random)).clip_joint, (std::vector<int>{-1, 1}));
}

TEST(Retarget, NothingInCommonNamesBothSides) {
  std::mt19937 random(1);
  try {
    match(test::chain(2), clip_of({"hips", "knee"}, 1, random));
    FAIL() << "must throw";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::data);
    const std::string line = error.what();
    EXPECT_NE(line.find("hips, knee"), std::string::npos) << line;
    EXPECT_NE(line.find("s0, s1"), std::string::npos) << line;
  }
}

TEST(Retarget, SegmentsTakeTheTurnsOfTheirJoints) {
  std::mt19937 random(2);
  Rig rig = test::chain(4);
  for (Segment& segment : rig.skeleton.segments)
    segment.joint.axes = test::random_turn(random).toRotationMatrix();
  const Clip clip = clip_of({"s0", "s1", "s2", "s3"}, 3, random);
  const Retarget map = match(rig, clip);
  for (std::size_t f = 0; f < 3; ++f) {
    const auto motion = forward(rig, pose_at(rig, clip, map, f));
    Quaterniond turned = Quaterniond::Identity();
    for (std::size_t s = 0; s < 4; ++s) {
      turned = turned * clip.rotation[4 * f + s];
      EXPECT_LT(motion[s].q.angularDistance(turned), 1e-9);
    }
    // Same bone lengths: the joints go where the clip's do.
    Vector3d at = clip.root_position[f];
    turned = clip.rotation[4 * f];
    for (std::size_t s = 1; s < 4; ++s) {
      at += turned * clip.joints[s].offset;
      turned = turned * clip.rotation[4 * f + s];
      EXPECT_LT((motion[s] * rig.skeleton.segments[s].joint.center - at).norm(), 1e-9);
    }
  }
}

TEST(Retarget, JointsWithoutSegmentAreFoldedIntoTheirDescendants) {
  std::mt19937 random(3);
  const Rig rig = test::chain(3);
  const Clip clip = clip_of({"s0", "extra", "s1", "more", "s2"}, 1, random);
  const auto motion = forward(rig, pose_at(rig, clip, match(rig, clip), 0));
  const auto& r = clip.rotation;
  EXPECT_LT(motion[1].q.angularDistance(r[0] * r[1] * r[2]), 1e-9);
  EXPECT_LT(motion[2].q.angularDistance(r[0] * r[1] * r[2] * r[3] * r[4]), 1e-9);
}

TEST(Retarget, SegmentsWithoutJointFollowTheirParent) {
  std::mt19937 random(4);
  const Rig rig = test::chain(3);
  const Clip clip = clip_of({"s0", "s2"}, 1, random);
  const Pose pose = pose_at(rig, clip, match(rig, clip), 0);
  EXPECT_LT(pose.rotation[1].angularDistance(Quaterniond::Identity()), 1e-12);
  const auto motion = forward(rig, pose);
  EXPECT_LT(motion[2].q.angularDistance(clip.rotation[0] * clip.rotation[1]), 1e-9);
}

// As a rib cage that rides on vertebrae which follow a joint that the clip moves: what hangs on it goes where
// the clip has it once they have followed.
TEST(Retarget, SegmentsWithoutJointFollowTheirLeaders) {
  std::mt19937 random(6);
  Rig rig = test::chain(4);
  rig.skeleton.segments[2].parent = 0;
  const Joint& leader = rig.skeleton.segments[1].joint;
  Joint& follower = rig.skeleton.segments[2].joint;
  for (std::size_t a = 0; a < 3; ++a)
    follower.coupled.push_back({leader.name, leader.sequence[a].name, follower.sequence[a].name, 0.5});
  const Clip clip = clip_of({"s0", "s1", "s3"}, 1, random);
  Pose pose = pose_at(rig, clip, match(rig, clip), 0);
  std::vector<ClampedJoint> clamped;
  constrain(rig.skeleton, pose, clamped);
  ASSERT_TRUE(clamped.empty());
  EXPECT_GT(pose.rotation[2].angularDistance(Quaterniond::Identity()), 0.1);
  const auto motion = forward(rig, pose);
  EXPECT_LT(motion[3].q.angularDistance(clip.rotation[0] * clip.rotation[1] * clip.rotation[2]), 1e-9);
}

TEST(Retarget, RootGoesItsWayFromItsOwnZeroOffset) {
  std::mt19937 random(5);
  const Rig rig = test::chain(2);
  Clip clip = clip_of({"world", "s0", "s1"}, 2, random);
  clip.joints[0].offset = {1, 2, 3};
  clip.root_position = {{1, 2, 3}, {101, 2, 3}};
  for (auto& q : clip.rotation) q = Quaterniond::Identity();
  clip.rotation[3] = test::turn(Vector3d::UnitX(), std::acos(-1.0) / 2);  // `world` in frame 1
  const Retarget map = match(rig, clip);
  EXPECT_LT(pose_at(rig, clip, map, 0).root_translation.norm(), 1e-12);
  // s0 hangs 100 mm above `world`, whose turn lays it down.
  EXPECT_LT((pose_at(rig, clip, map, 1).root_translation - Vector3d(100, -100, -100)).norm(), 1e-9);
}

TEST(Retarget, RefusesAFrameBeyondTheClip) {
  std::mt19937 random(6);
  const Rig rig = test::chain(2);
  const Clip clip = clip_of({"s0"}, 2, random);
  EXPECT_THROW(pose_at(rig, clip, match(rig, clip), 2), Error);
}

TEST(Retarget, RefusesAMatchOfAnotherRigAndAFrameOfAnotherClip) {
  std::mt19937 random(6);
  const Rig rig = test::chain(2);
  const Clip clip = clip_of({"s0"}, 2, random), other = clip_of({"s0", "s1", "s2"}, 1, random);
  expect_error(ErrorKind::internal, "motion walk: a match of 3 segments for 2 (match the clip with this rig)",
               [&] { pose_at(rig, clip, match(test::chain(3), clip), 0); });
  expect_error(ErrorKind::internal,
               "motion walk: a frame of 1 rotations for 3 joints (read the frame from this clip)", [&] {
                 places(other, {Vector3d::Zero(), {Quaterniond::Identity()}});
               });
}

}  // namespace
}  // namespace ecorche::kinematics
