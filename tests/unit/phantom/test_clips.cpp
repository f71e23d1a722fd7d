// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/retarget.hpp"
#include "tests/unit/phantom/mesh_checks.hpp"
#include "tests/unit/phantom/small_phantom.hpp"

namespace ecorche::phantom {
namespace {

const Clip& clip_named(const std::string& name) {
  for (const Clip& clip : small_phantom().clips) {
    if (clip.name == name) return clip;
  }
  throw Error(ErrorKind::internal, "test", "no clip " + name, "");
}

Rig true_rig() {
  return {small_phantom().truth, std::vector<JointFit>(small_phantom().truth.segments.size())};
}

TEST(Clips, LastLongEnoughAndLoop) {
  for (const Clip& clip : small_phantom().clips) {
    EXPECT_GE(static_cast<double>(clip.frames()) * clip.frame_seconds, 2.0);
    EXPECT_EQ(clip.rotation.size(), clip.frames() * clip.joints.size());
    // The step from the last frame to the first is as small as those between.
    double largest = 0, around = 0;
    for (std::size_t j = 0; j < clip.joints.size(); ++j) {
      for (std::size_t f = 0; f + 1 < clip.frames(); ++f) {
        largest = std::max(largest, clip.rotation[f * clip.joints.size() + j].angularDistance(
                                        clip.rotation[(f + 1) * clip.joints.size() + j]));
      }
      around = std::max(around, clip.rotation[(clip.frames() - 1) * clip.joints.size() + j].angularDistance(
                                    clip.rotation[j]));
    }
    EXPECT_LE(around, largest) << clip.name;
    EXPECT_LT(largest, 0.35) << clip.name;
  }
}

TEST(Clips, StayWithinTheLimitsAndOnTheHinges) {
  const Rig rig = true_rig();
  for (const Clip& clip : small_phantom().clips) {
    const kinematics::Retarget retarget = kinematics::match(rig, clip);
    EXPECT_TRUE(retarget.unused_joints.empty()) << retarget.unused_joints.front();
    EXPECT_TRUE(retarget.still_segments.empty()) << retarget.still_segments.front();
    for (std::size_t frame = 0; frame < clip.frames(); ++frame) {
      Pose pose = kinematics::pose_at(rig, clip, retarget, frame);
      std::vector<ClampedJoint> clamped;
      kinematics::constrain(rig.skeleton, pose, clamped);
      for (const ClampedJoint& joint : clamped) {
        ADD_FAILURE() << clip.name << " frame " << frame << ": "
                      << rig.skeleton.segments[static_cast<std::size_t>(joint.joint)].joint.name << " lost "
                      << joint.removed * 180 / 3.14159 << " deg";
      }
    }
  }
}

TEST(Clips, WalkIsAGait) {
  const Rig rig = true_rig();
  const Clip& walk = clip_named("walk");
  const kinematics::Retarget retarget = kinematics::match(rig, walk);
  double knee_max = 0, hip_min = 1e9, hip_max = -1e9;
  for (std::size_t frame = 0; frame < walk.frames(); ++frame) {
    const Pose pose = kinematics::pose_at(rig, walk, retarget, frame);
    const auto angle = [&](const char* joint) {
      const auto row = static_cast<std::size_t>(rig.skeleton.find_joint(joint));
      return kinematics::angles_from_rotation(rig.skeleton.segments[row].joint, pose.rotation[row])[0] * 180 /
             3.14159265358979;
    };
    knee_max = std::max(knee_max, angle("knee_left"));
    hip_min = std::min(hip_min, angle("hip_left"));
    hip_max = std::max(hip_max, angle("hip_left"));
  }
  EXPECT_NEAR(knee_max, 60, 6);
  EXPECT_NEAR(hip_max, 29, 6);
  EXPECT_NEAR(hip_min, -12, 6);
}

TEST(Clips, BendKeepsTheFeetAndReachesDown) {
  const Rig rig = true_rig();
  const Clip& bend = clip_named("bend");
  const kinematics::Retarget retarget = kinematics::match(rig, bend);
  const auto row = [&](const char* segment) {
    return static_cast<std::size_t>(rig.skeleton.find_segment(segment));
  };
  const Vec wrist = rig.skeleton.segments[row("hand_left")].joint.center;
  double reach = 0;
  for (std::size_t frame = 0; frame < bend.frames(); ++frame) {
    const auto motion = kinematics::forward(rig, kinematics::pose_at(rig, bend, retarget, frame));
    for (const char* foot : {"foot_left", "foot_right"}) {
      const Vec ankle = rig.skeleton.segments[row(foot)].joint.center;
      EXPECT_LT((motion[row(foot)] * ankle - ankle).norm(), 12) << frame;
    }
    reach = std::max(reach, wrist.y() - (motion[row("hand_left")] * wrist).y());
  }
  EXPECT_GT(reach, 350);
}

}  // namespace
}  // namespace ecorche::phantom
