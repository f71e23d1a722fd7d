// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rig_clip.hpp"

#include <gtest/gtest.h>

#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/retarget.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

TEST(RigClip, MovesItsJointsAsTheSegmentsGo) {
  std::mt19937 random(9);
  Rig rig = test::chain(5);
  rig.skeleton.segments[4].parent = 1;  // a branch
  for (Segment& segment : rig.skeleton.segments) {
    segment.joint.axes = test::random_turn(random).toRotationMatrix();
    segment.joint.center += Eigen::Vector3d(random() % 50, random() % 50, 0);
  }
  Clip clip = rig_clip(rig, "a", 0.1);
  std::vector<Pose> poses;
  for (int f = 0; f < 5; ++f) {
    Pose pose = Pose::rest(5);
    pose.root_translation = {1.0 * f, 2, 3};
    for (auto& q : pose.rotation) q = test::random_turn(random);
    EXPECT_TRUE(add_frame(rig, pose, clip));
    poses.push_back(pose);
  }
  for (std::size_t f = 0; f < 5; ++f) {
    const auto motion = forward(rig, poses[f]);
    const auto begin = clip.rotation.begin() + static_cast<std::ptrdiff_t>(5 * f);
    const ClipPlaces at = places(clip, {clip.root_position[f], {begin, begin + 5}});
    for (std::size_t s = 0; s < 5; ++s) {
      EXPECT_LT((motion[s] * rig.skeleton.segments[s].joint.center - at.point[s]).norm(), 1e-9);
      EXPECT_LT(motion[s].q.angularDistance(at.turn[s]), 1e-7);
    }
    // And back: the clip's zero pose is the scan.
    const Pose back = pose_at(rig, clip, match(rig, clip), f);
    for (std::size_t s = 0; s < 5; ++s)
      EXPECT_LT(back.rotation[s].angularDistance(poses[f].rotation[s]), 1e-7);
    EXPECT_LT((back.root_translation - poses[f].root_translation).norm(), 1e-9);
  }
  Pose slid = Pose::rest(5);
  slid.translation[2] = {1, 0, 0};
  EXPECT_FALSE(add_frame(rig, slid, clip));
}

}  // namespace
}  // namespace ecorche::kinematics
