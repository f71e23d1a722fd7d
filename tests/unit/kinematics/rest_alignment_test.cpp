// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rest_alignment.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "core/kinematics/forward.hpp"
#include "core/kinematics/retarget.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A trunk with two arms that hang: collar (short), upper arm, forearm, hand.
Rig hanging_arms() {
  Rig rig;
  const auto add = [&](const char* name, int parent, const Vector3d& center) {
    Segment segment;
    segment.name = name;
    segment.parent = parent;
    segment.joint.name = std::string("joint_") + name;
    segment.joint.center = center;
    segment.joint.sequence = test::sequence({0, 1, 2});
    rig.skeleton.segments.push_back(segment);
    rig.fits.push_back({segment.joint.name, CenterRule::given, 0, 0, 1, 0});
  };
  add("trunk", -1, {0, 0, 0});
  add("collar_left", 0, {20, 0, 500});
  add("arm_left", 1, {80, 0, 500});
  add("forearm_left", 2, {100, 0, 220});
  add("hand_left", 3, {110, -40, -30});
  return rig;
}

// The same joints, arms stretched to the side.
Clip stretched_arms() {
  Clip clip;
  clip.joints = {{"trunk", -1, {0, 0, 0}},
                 {"collar_left", 0, {0, -30, 480}},
                 {"arm_left", 1, {70, 30, 10}},
                 {"forearm_left", 2, {270, 0, 0}},
                 {"hand_left", 3, {240, 0, 0}}};
  clip.root_position.emplace_back(0, 0, 0);
  clip.rotation.assign(clip.joints.size(), Quaterniond::Identity());
  return clip;
}

Vector3d direction(const Rig& rig, const std::vector<RigidTransform>& motion, int from, int to) {
  const auto at = [&](int s) {
    const auto i = static_cast<std::size_t>(s);
    return Vector3d(motion[i] * rig.skeleton.segments[i].joint.center);
  };
  return (at(to) - at(from)).normalized();
}

TEST(RestAlignment, LimbsTakeTheClipsDirections) {
  const Rig rig = hanging_arms();
  const Clip clip = stretched_arms();
  const auto motion = forward(rig, pose_at(rig, clip, match(rig, clip), 0));
  EXPECT_LT((direction(rig, motion, 2, 3) - Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((direction(rig, motion, 3, 4) - Vector3d::UnitX()).norm(), 1e-9);
}

TEST(RestAlignment, ShortSegmentsAndTrunkStayWithTheirParent) {
  const Rig rig = hanging_arms();
  const Clip clip = stretched_arms();
  const auto turn = align_rest(rig, zero_places(clip), match(rig, clip).clip_joint);
  EXPECT_EQ(turn[0].angularDistance(Quaterniond::Identity()), 0);
  EXPECT_EQ(turn[1].angularDistance(Quaterniond::Identity()), 0)
      << "a collar bone's direction is the maker's";
  EXPECT_EQ(turn[4].angularDistance(turn[3]), 0) << "a hand has no child";
}

TEST(RestAlignment, TurnsOfTheClipComeOnTop) {
  const Rig rig = hanging_arms();
  Clip clip = stretched_arms();
  clip.rotation[2] = test::turn(Vector3d::UnitY(), std::numbers::pi / 2);  // x to -z: down
  const auto motion = forward(rig, pose_at(rig, clip, match(rig, clip), 0));
  EXPECT_LT((direction(rig, motion, 2, 3) + Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(RestAlignment, AFewDegreesAreAnatomy) {
  const Rig rig = hanging_arms();
  Clip clip = stretched_arms();
  const Vector3d scanned(20, 0, -280);
  clip.joints[3].offset = test::turn(Vector3d::UnitY(), 4 * std::numbers::pi / 180) * scanned;
  const auto turn = align_rest(rig, zero_places(clip), match(rig, clip).clip_joint);
  EXPECT_EQ(turn[2].angularDistance(Quaterniond::Identity()), 0);
  clip.joints[3].offset = test::turn(Vector3d::UnitY(), 6 * std::numbers::pi / 180) * scanned;
  EXPECT_NEAR(align_rest(rig, zero_places(clip), match(rig, clip).clip_joint)[2].angularDistance(
                  Quaterniond::Identity()),
              6 * std::numbers::pi / 180, 1e-9);
}

TEST(RestAlignment, JointsThatTheClipLacksOrPlacesNowhereAreLeft) {
  const Rig rig = hanging_arms();
  Clip clip = stretched_arms();
  clip.joints[3].offset.setZero();
  const auto turn = align_rest(rig, zero_places(clip), match(rig, clip).clip_joint);
  EXPECT_EQ(turn[2].angularDistance(Quaterniond::Identity()), 0);
  const auto none = align_rest(rig, zero_places(clip), {0, 1, -1, -1, -1});
  for (const Quaterniond& q : none) EXPECT_EQ(q.angularDistance(Quaterniond::Identity()), 0);
}

}  // namespace
}  // namespace ecorche::kinematics
