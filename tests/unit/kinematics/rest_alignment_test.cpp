// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rest_alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/values/error.hpp>
#include "core/kinematics/retarget.hpp"
#include "core/kinematics/rig_clip.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A trunk with two arms that hang: collar (short), upper arm, forearm, hand.
Rig hanging_arms() {
  Rig rig;
  test::add_segment(rig, "trunk", -1, {0, 0, 0});
  test::add_segment(rig, "collar_left", 0, {20, 0, 500});
  test::add_segment(rig, "arm_left", 1, {80, 0, 500});
  test::add_segment(rig, "forearm_left", 2, {100, 0, 220});
  test::add_segment(rig, "hand_left", 3, {110, -40, -30});
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

std::vector<Quaterniond> at_zero(const Rig& rig, const Clip& clip, const std::vector<int>& clip_joint) {
  const ClipPlaces zero = zero_places(clip);
  return align_rest(rig, std::span(&zero, 1), clip_joint).rest_turn;
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
  const auto turn = at_zero(rig, clip, match(rig, clip).clip_joint);
  EXPECT_LT((turn[0] * Vector3d(20, 0, 500).normalized() - Vector3d(0, -30, 480).normalized()).norm(), 1e-9);
  EXPECT_EQ(turn[1].angularDistance(turn[0]), 0) << "a collar bone's direction is the maker's";
  EXPECT_EQ(turn[4].angularDistance(turn[3]), 0) << "a hand has no child";
}

TEST(RestAlignment, TurnsOfTheClipComeOnTop) {
  const Rig rig = hanging_arms();
  Clip clip = stretched_arms();
  clip.rotation[2] = test::turn(Vector3d::UnitY(), std::numbers::pi / 2);  // x to -z: down
  const auto motion = forward(rig, pose_at(rig, clip, match(rig, clip), 0));
  EXPECT_LT((direction(rig, motion, 2, 3) + Vector3d::UnitZ()).norm(), 1e-9);
}

// Two clips of one take differ by that much in their zero poses: played, they must not.
TEST(RestAlignment, AFewDegreesAreTakenToo) {
  const Rig rig = hanging_arms();
  for (const double degrees : {0.5, 4.0, 6.0}) {
    Clip clip = stretched_arms();
    clip.joints[1].offset = {20, 0, 500};
    clip.joints[3].offset =
        test::turn(Vector3d::UnitY(), degrees * std::numbers::pi / 180) * Vector3d(20, 0, -280);
    const auto turn = at_zero(rig, clip, match(rig, clip).clip_joint);
    EXPECT_NEAR(turn[2].angularDistance(Quaterniond::Identity()), degrees * std::numbers::pi / 180, 1e-9);
  }
}

// The rig's elbow bends about an axis of its own; the clip's is told by where its hand goes. Whatever the
// clip's zero pose leaves open, the arm that is played bends as the rig's does, and nothing is left for
// limits to take.
TEST(RestAlignment, ALimbBendsInTheClipsPlane) {
  Rig rig = hanging_arms();
  Joint& elbow = rig.skeleton.segments[3].joint;
  elbow.kind = JointKind::hinge;
  elbow.axes = test::turn(Vector3d::UnitZ(), 0.4).toRotationMatrix();
  rig.skeleton.segments[4].joint.center = rig.skeleton.segments[3].joint.center + Vector3d(18, 0, -250);
  Clip clip = stretched_arms();  // along x, and its elbow bends about z: the hand goes to +y
  clip.joints[1].offset = {20, 0, 500};
  std::vector<ClipFrame> frames;
  for (const double bend : {0.1, 0.6, 1.2, -0.05}) {
    ClipFrame frame{Vector3d::Zero(), std::vector<Quaterniond>(5, Quaterniond::Identity())};
    frame.rotation[2] = test::turn(Vector3d(1, 2, 3), bend);
    frame.rotation[3] = test::turn(Vector3d::UnitZ(), bend);
    frames.push_back(frame);
  }
  Retarget retarget = match(rig, clip);
  const auto twisted = [&](const ClipFrame& frame) {
    const Quaterniond q = pose_at(rig, clip, retarget, frame).rotation[3];
    return q.angularDistance(clamp(elbow, q));
  };
  EXPECT_GT(twisted(frames[2]), 0.3) << "directions alone leave the arm turned about itself";
  find_bends(rig, clip, frames, retarget);
  ASSERT_TRUE(retarget.bends[3].known);
  EXPECT_LT((retarget.bends[3].above - Vector3d::UnitZ()).norm(), 1e-9);
  for (const ClipFrame& frame : frames)
    EXPECT_LT(twisted(frame), 0.1);  // the rig's axis is not square to its arm
  // The same at a frame, and the wrist goes where the clip's goes.
  align_at(rig, clip, std::vector{frames[1]}, retarget);
  for (const ClipFrame& frame : frames) EXPECT_LT(twisted(frame), 0.1);
  const auto motion = forward(rig, pose_at(rig, clip, retarget, frames[2]));
  const ClipPlaces at = places(clip, frames[2]);
  EXPECT_LT((direction(rig, motion, 3, 4) - (at.point[4] - at.point[3]).normalized()).norm(), 1e-6);
  EXPECT_LT((direction(rig, motion, 2, 3) - (at.point[3] - at.point[2]).normalized()).norm(), 1e-6);
}

// A clip that was made with this rig, its elbow's axis far from square to the arm: nothing is to be turned.
TEST(RestAlignment, ARigsOwnMotionIsLeftAsItIs) {
  Rig rig = hanging_arms();
  Joint& elbow = rig.skeleton.segments[3].joint;
  elbow.kind = JointKind::hinge;
  elbow.axes = (test::turn(Vector3d::UnitZ(), 0.4) * test::turn(Vector3d::UnitY(), 0.3)).toRotationMatrix();
  Clip clip = rig_clip(rig, "own", 0.01);
  std::vector<ClipFrame> frames;
  for (const double flexion : {0.4, 0.9, 1.5, 0.6}) {
    Pose pose = Pose::rest(5);
    pose.rotation[2] = test::turn(Vector3d(3, 1, 2), 0.8 * flexion);
    pose.rotation[3] = rotation_from_angles(elbow, {flexion, 0, 0});
    add_frame(rig, pose, clip);
    const auto begin = clip.rotation.end() - 5;
    frames.push_back({clip.root_position.back(), {begin, clip.rotation.end()}});
  }
  Retarget retarget = match(rig, clip);
  find_bends(rig, clip, frames, retarget);
  ASSERT_TRUE(retarget.bends[3].known);
  for (const Quaterniond& q : retarget.alignment) EXPECT_LT(q.angularDistance(Quaterniond::Identity()), 1e-7);
}

TEST(RestAlignment, ALimbThatHardlyBendsTellsNothing) {
  Rig rig = hanging_arms();
  rig.skeleton.segments[3].joint.kind = JointKind::hinge;
  const Clip clip = stretched_arms();
  ClipFrame still{Vector3d::Zero(), std::vector<Quaterniond>(5, Quaterniond::Identity())};
  Retarget retarget = match(rig, clip);
  const auto before = retarget.alignment;
  find_bends(rig, clip, std::vector<ClipFrame>{still}, retarget);
  EXPECT_FALSE(retarget.bends[3].known);
  // Now this way, now that: no axis either.
  ClipFrame one = still, other = still;
  one.rotation[3] = test::turn(Vector3d::UnitZ(), 0.8);
  other.rotation[3] = test::turn(Vector3d::UnitY(), 0.8);
  find_bends(rig, clip, std::vector<ClipFrame>{one, other}, retarget);
  EXPECT_FALSE(retarget.bends[3].known);
  for (std::size_t s = 0; s < 5; ++s) EXPECT_LT(retarget.alignment[s].angularDistance(before[s]), 1e-7);
}

TEST(RestAlignment, JointsThatTheClipLacksOrPlacesNowhereAreLeft) {
  const Rig rig = hanging_arms();
  Clip clip = stretched_arms();
  clip.joints[1].offset = {20, 0, 500};
  clip.joints[3].offset.setZero();
  const auto turn = at_zero(rig, clip, match(rig, clip).clip_joint);
  EXPECT_LT(turn[2].angularDistance(Quaterniond::Identity()), 1e-15);
  const auto none = at_zero(rig, clip, {0, 1, -1, -1, -1});
  for (const Quaterniond& q : none) EXPECT_LT(q.angularDistance(Quaterniond::Identity()), 1e-15);
}

// A hand that looks aside in one frame, the other way in the next: straight in the mean, whatever the arm
// does.
TEST(RestAlignment, OverSeveralFramesWhatIsOpenIsMeant) {
  const Rig rig = hanging_arms();
  const Clip clip = rig_clip(rig, "own", 0.01);
  const auto frame = [&](double arm, double hand) {
    ClipFrame out{Vector3d::Zero(), std::vector<Quaterniond>(5, Quaterniond::Identity())};
    out.rotation[2] = test::turn(Vector3d(0, 1, 0.5), arm);
    out.rotation[4] = test::turn(Vector3d::UnitZ(), hand);
    return out;
  };
  Retarget retarget = match(rig, clip);
  align_at(rig, clip, std::vector{frame(0.3, 0.4)}, retarget);
  EXPECT_NEAR(retarget.alignment[4].angularDistance(retarget.alignment[3]), 0.4, 1e-9) << "one frame's own";
  align_at(rig, clip, std::vector{frame(0.3, 0.4), frame(0.3, -0.4)}, retarget);
  EXPECT_NEAR(retarget.alignment[4].angularDistance(retarget.alignment[3]), 0, 1e-9);
  // Limbs point where the clip's do at every frame.
  const auto motion = forward(rig, pose_at(rig, clip, retarget, frame(1.2, 0)));
  const ClipPlaces at = places(clip, frame(1.2, 0));
  EXPECT_LT((direction(rig, motion, 2, 3) - (at.point[3] - at.point[2]).normalized()).norm(), 1e-9);
  // The first says where the body stands; told apart here by a way of its own.
  ClipFrame away = frame(0.3, 0.4);
  away.root_position = {1, 2, 3};
  align_at(rig, clip, std::vector{away, frame(0.1, -0.4)}, retarget);
  EXPECT_EQ(retarget.home, Vector3d(1, 2, 3));
  try {
    align_at(rig, clip, {}, retarget);
    FAIL() << "aligned at nothing";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), "alignment: no reference (name one or more)");
  }
}

// A T-pose with its palm down, played with the hand swinging about straight: the patient's hand does so too.
TEST(RestAlignment, AHandOfATPoseHangsAsOverTheClip) {
  Rig rig = hanging_arms();
  test::add_segment(rig, "finger_left", 4, {110, -45, -80});
  Clip clip = stretched_arms();
  clip.joints.push_back({"finger_left", 4, {60, 0, 0}});
  clip.rotation.emplace_back(Quaterniond::Identity());
  const auto frames_of = [&](double down, double off) {
    std::vector<ClipFrame> frames;
    for (const double swing : {-0.3, 0.3}) {
      ClipFrame frame{Vector3d::Zero(), std::vector<Quaterniond>(6, Quaterniond::Identity())};
      frame.rotation[2] = test::turn(Vector3d::UnitY(), down);
      frame.rotation[4] = test::turn(Vector3d::UnitX(), off) * test::turn(Vector3d::UnitZ(), swing);
      frames.push_back(frame);
    }
    return frames;
  };
  const auto hand = [&](double stretched, double off) {
    Clip made = clip;  // its arm turned down from the T-pose by `stretched` in the zero pose
    const Quaterniond down = test::turn(Vector3d::UnitY(), stretched);
    made.joints[3].offset = down * clip.joints[3].offset;
    made.joints[4].offset = down * clip.joints[4].offset;
    const auto frames = frames_of(1.2 - stretched, off);
    Retarget retarget = match(rig, made);
    find_bends(rig, made, frames, retarget);
    const Pose pose = pose_at(rig, made, retarget, frames[0]);
    EXPECT_LT(retarget.rest_turn[4].angularDistance(retarget.alignment[4]), 1e-7) << "the zero pose's turn";
    EXPECT_LT(pose.rotation[5].angularDistance(Quaterniond::Identity()), 1e-6) << "fingers follow";
    return pose.rotation[4].angularDistance(Quaterniond::Identity());
  };
  EXPECT_NEAR(hand(0, 1.4), 0.3, 1e-6);
  // An arm that hangs in the zero pose tells how its hand is: then 1.4 is how it moves.
  EXPECT_GT(hand(1.2, 1.4), 1.2);
}

// Both arms as far out count alike; one that hangs nearly as scanned counts by how much nearer it is.
TEST(RestAlignment, FramesNearTheScanCountMost) {
  const Rig rig = hanging_arms();
  const Clip clip = rig_clip(rig, "own", 0.01);
  const auto frame = [&](double arm, double hand) {
    ClipFrame out{Vector3d::Zero(), std::vector<Quaterniond>(5, Quaterniond::Identity())};
    out.rotation[2] = test::turn(Vector3d::UnitY(), arm);
    out.rotation[4] = test::turn(Vector3d::UnitZ(), hand);
    return out;
  };
  Retarget retarget = match(rig, clip);
  const double hand = 0.2;
  align_at(rig, clip, std::vector{frame(0.1, hand), frame(0.5, 0)}, retarget);
  // Unit quaternions of weights 1 and 1/5 (the whole arm turns, so both limbs are off by the same).
  const double half = std::atan2(std::sin(hand / 2), std::cos(hand / 2) + 0.2);
  EXPECT_NEAR(retarget.alignment[4].angularDistance(retarget.alignment[3]), 2 * half, 1e-4);
}

}  // namespace
}  // namespace ecorche::kinematics
