// SPDX-License-Identifier: Apache-2.0
// Motions of any kind: names, references that are no zero pose, keys, named angles, reports.
#include <gtest/gtest.h>

#include <numbers>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/kinematics/interpolate.hpp>
#include <ecorche/kinematics/named_angles.hpp>
#include <ecorche/values/error.hpp>
#include "core/kinematics/joint_names.hpp"
#include "core/kinematics/motion_report.hpp"
#include "core/kinematics/retarget.hpp"
#include "tests/unit/io/scratch.hpp"
#include "tests/unit/kinematics/rigs.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
using NameList = std::vector<std::string>;

TEST(JointNames, ForeignSkeletonsMeanTheSame) {
  const auto has = [](const std::vector<std::string>& names, const char* name) {
    const auto all = synonyms(names);
    return std::find(all.begin(), all.end(), name) != all.end();
  };
  EXPECT_TRUE(has({"thigh_left"}, "lfemur"));
  EXPECT_TRUE(has({"LeftUpLeg"}, "ccbaselthigh"));
  EXPECT_FALSE(has({"thigh_left"}, "rfemur"));
  EXPECT_TRUE(has({"upper_arm_right"}, "rhumerus"));
  EXPECT_TRUE(synonyms({"tail"}).empty());
}

TEST(JointNames, ACollarMakesTheShoulderAnArm) {
  EXPECT_EQ(plain_names({"LeftCollar", "LeftShoulder", "LeftElbow", "RightHip", "Neck", "Chest2"}),
            (NameList{"leftshoulder", "leftarm", "leftforearm", "rightupleg", "neck", "spine1"}));
  EXPECT_EQ(plain_names({"LeftShoulder", "LeftArm"}), (NameList{"leftshoulder", "leftarm"}));
}

// A clip of test::legs under foreign names.
Clip walking(std::size_t frames) {
  std::mt19937 random(4);
  Clip clip;
  clip.name = "walk";
  clip.joints = {{"Hips", -1, {0, 0, 900}},        {"LeftUpLeg", 0, {90, 0, -20}},
                 {"LeftLeg", 1, {0, 10, -400}},    {"LeftFoot", 2, {0, 10, -400}},
                 {"RightUpLeg", 0, {-90, 0, -20}}, {"RightLeg", 4, {0, 10, -400}},
                 {"RightFoot", 5, {0, 10, -400}}};
  for (std::size_t f = 0; f < frames; ++f) {
    clip.root_position.emplace_back(0, -10.0 * static_cast<double>(f), 900);
    for (std::size_t j = 0; j < clip.joints.size(); ++j)
      clip.rotation.push_back(f == 0 ? Quaterniond::Identity()
                                     : Quaterniond::Identity().slerp(0.2, test::random_turn(random)));
  }
  return clip;
}

// The same motion of a rig whose every joint has axes of its own, so that its zero pose is no pose of a body.
Clip with_own_axes(const Clip& clip, std::mt19937& random) {
  Clip out = clip;
  std::vector<Quaterniond> bind;
  for (std::size_t j = 0; j < clip.joints.size(); ++j) bind.push_back(test::random_turn(random));
  const auto above = [&](std::size_t j) {
    return clip.joints[j].parent < 0 ? Quaterniond::Identity()
                                     : bind[static_cast<std::size_t>(clip.joints[j].parent)];
  };
  for (std::size_t j = 0; j < clip.joints.size(); ++j)
    out.joints[j].offset = above(j).conjugate() * clip.joints[j].offset;
  for (std::size_t i = 0; i < out.rotation.size(); ++i) {
    const std::size_t j = i % clip.joints.size();
    out.rotation[i] = above(j).conjugate() * clip.rotation[i] * bind[j];
  }
  return out;
}

ClipFrame frame_of(const Clip& clip, std::size_t f) {
  const auto begin = clip.rotation.begin() + static_cast<std::ptrdiff_t>(f * clip.joints.size());
  return {clip.root_position[f], {begin, begin + static_cast<std::ptrdiff_t>(clip.joints.size())}};
}

TEST(Retarget, AxesOfTheFileDoNotMatterAtAReference) {
  std::mt19937 random(8);
  const Rig rig = test::legs();
  const Clip plain = walking(20), odd = with_own_axes(plain, random);
  const Retarget zero = match(rig, plain);
  EXPECT_LT(zero.limbs.worst, 1e-6);
  EXPECT_NEAR(zero.limbs.figure, 1, 1e-9);
  Retarget at = match(rig, odd);
  EXPECT_GT(at.limbs.worst, 30 * kDegree) << "its zero pose is no pose of a body";
  align_at(rig, odd, std::vector{frame_of(odd, 0)}, at);
  for (std::size_t f = 0; f < 20; ++f) {
    const Pose a = pose_at(rig, plain, zero, f), b = pose_at(rig, odd, at, f);
    EXPECT_LT((a.root_translation - b.root_translation).norm(), 1e-9);
    for (std::size_t j = 0; j < 7; ++j)
      EXPECT_LT(a.rotation[j].angularDistance(b.rotation[j]), 1e-7) << f << " " << j;
  }
}

TEST(Retarget, AReferenceThatLooksAsideTurnsTheScan) {
  const Rig rig = test::legs();
  Clip clip = walking(2);
  const Quaterniond aside = test::turn(Vector3d::UnitZ(), 70 * kDegree);
  clip.rotation[0] = aside;
  Retarget at = match(rig, clip);
  align_at(rig, clip, std::vector{frame_of(clip, 0)}, at);
  // At the reference itself the patient stands so, straight.
  const Pose pose = pose_at(rig, clip, at, 0);
  EXPECT_LT(pose.rotation[0].angularDistance(aside), 1e-6);
  for (std::size_t j = 1; j < 7; ++j)
    EXPECT_LT(pose.rotation[j].angularDistance(Quaterniond::Identity()), 1e-6);
}

TEST(Retarget, TheUserSaysWhatMovesWhat) {
  const Rig rig = test::legs();
  Clip clip = walking(1);
  clip.joints[2].name = "KneeOfMine";
  EXPECT_EQ(match(rig, clip).clip_joint[2], -1);
  const Retarget map = match(rig, clip, {{"KneeOfMine", "shank_left"}, {"RightFoot", ""}});
  EXPECT_EQ(map.clip_joint[2], 2);
  EXPECT_EQ(map.clip_joint[6], -1);
  EXPECT_TRUE(map.unused_joints.empty());
  const auto refused = [&](const NameMap& names, const std::string& part) {
    try {
      match(rig, clip, names);
      FAIL() << part;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::config);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  refused({{"Knee", "shank_left"}}, "the clip has no joint 'Knee'");
  refused({{"LeftFoot", "paw"}}, "the skeleton has no segment 'paw'");
  refused({{"LeftFoot", "pelvis"}, {"RightFoot", "pelvis"}}, "two joints move the segment 'pelvis'");
}

TEST(Retarget, AZeroPoseBelowTheFloorStandsOnIt) {
  const Rig rig = test::legs();
  Clip clip = walking(1);
  clip.joints[0].offset.setZero();  // as CMU's
  clip.root_position[0] = {0, 0, 20 + 2 * std::hypot(10, 400)};
  EXPECT_LT(pose_at(rig, clip, match(rig, clip), 0).root_translation.norm(), 1e-9);
}

TEST(Interpolate, TurnsAtAnEvenPaceTheShorterWay) {
  Pose a = Pose::rest(2), b = a;
  b.root_translation = {10, 20, 30};
  b.rotation[1] = test::turn(Vector3d(1, 2, 3), 100 * kDegree);
  b.rotation[1].coeffs() *= -1;  // the same turn
  const Pose half = between(a, b, 0.3);
  EXPECT_LT(half.rotation[1].angularDistance(test::turn(Vector3d(1, 2, 3), 30 * kDegree)), 1e-9);
  EXPECT_LT((half.root_translation - Vector3d(3, 6, 9)).norm(), 1e-12);
  expect_error(ErrorKind::internal, "interpolation: poses of 2 and 3 joints (use poses of one rig)",
               [&] { between(a, Pose::rest(3), 0.5); });
  expect_error(ErrorKind::internal, "interpolation: keys without poses (give one pose a key)",
               [] { at(PoseKeys{}, 0.5); });
  PoseKeys keys{{1, 3}, {a, b}, Ease::linear};
  EXPECT_LT(at(keys, 1.6).rotation[1].angularDistance(half.rotation[1]), 1e-9);
  EXPECT_LT(at(keys, 0).rotation[1].angularDistance(a.rotation[1]), 1e-9);
  EXPECT_LT(at(keys, 9).rotation[1].angularDistance(b.rotation[1]), 1e-9);
  keys.ease = Ease::smooth;
  EXPECT_NEAR(at(keys, 1.6).root_translation.x(), 10 * (3 * 0.09 - 2 * 0.027), 1e-12);
}

TEST(NamedAngles, OppositesAreTurnedRound) {
  Rig rig = test::chain(2);
  rig.skeleton.segments[1].joint.sequence[1].name = "abduction";
  rig.skeleton.segments[1].joint.sequence[2].rest = 0.3;
  const auto found = find_named_angle(rig.skeleton, "j1", "adduction");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sign, -1);
  EXPECT_FALSE(find_named_angle(rig.skeleton, "j1", "tilt"));
  EXPECT_FALSE(find_named_angle(rig.skeleton, "j7", "flexion"));
  const auto flexion = find_named_angle(rig.skeleton, "j1", "flexion");
  const Pose pose = pose_of(rig.skeleton, {{*found, 0.4}, {*flexion, 0.1}, {*flexion, 0.2}});
  const auto angles = angles_from_rotation(rig.skeleton.segments[1].joint, pose.rotation[1]);
  EXPECT_NEAR(angles[0], 0.3, 1e-12);
  EXPECT_NEAR(angles[1], -0.4, 1e-12);
  EXPECT_NEAR(angles[2], 0.3, 1e-12) << "what is not named is at rest";
}

// A body that glides by 100 mm/s on straight legs, then hangs in the air.
TEST(MotionReport, GlidingFeetAndBentLimits) {
  Rig rig = test::legs();
  AngleAxis& flexion = rig.skeleton.segments[2].joint.sequence[0];
  flexion.min = 0;
  flexion.max = 60 * kDegree;
  const auto pose = [&](std::size_t frame) {
    Pose p = Pose::rest(7);
    p.root_translation = {0, -1.0 * static_cast<double>(frame), frame < 50 ? 0.0 : 300.0};
    if (frame == 20)
      p.rotation[2] = rotation_from_angles(rig.skeleton.segments[2].joint, {80 * kDegree, 0, 0});
    if (frame == 30)
      p.rotation[2] = rotation_from_angles(rig.skeleton.segments[2].joint, {70 * kDegree, 0, 0});
    return p;
  };
  const MotionReport made = report(rig, 100, 0.01, pose);
  ASSERT_EQ(made.feet.size(), 2U);
  EXPECT_EQ(made.feet[1].joint, "foot_right_joint");
  EXPECT_NEAR(made.feet[1].contact_share, 0.5, 1e-12);
  EXPECT_NEAR(made.feet[1].mean_mm_per_s, 100 * 49.0 / 50, 1e-9);
  EXPECT_NEAR(made.feet[1].worst_mm_per_s, 100, 1e-9);
  ASSERT_EQ(made.limits.size(), 1U);
  EXPECT_EQ(made.limits[0].joint, "shank_left_joint");
  EXPECT_NEAR(made.limits[0].share, 0.02, 1e-12);
  EXPECT_NEAR(made.limits[0].worst, 20 * kDegree, 1e-9);
  EXPECT_NEAR(made.limits[0].mean, 15 * kDegree, 1e-9);
  EXPECT_EQ(made.limits[0].worst_frame, 20U);
}

// On a treadmill: feet go back while they stand, forward in the air, and the body gets nowhere.
TEST(MotionReport, FeetThatWalkInPlaceDoNotSlide) {
  const Rig rig = test::legs();
  const auto walk = [](double stray_mm) {
    return [stray_mm](std::size_t frame) {
      const std::size_t at = frame % 50;
      const bool stands = at < 26;
      Pose p = Pose::rest(7);
      p.root_translation = {frame == 10 ? stray_mm : 0.0,
                            stands ? 4.0 * static_cast<double>(at) : 4.0 * static_cast<double>(50 - at),
                            stands ? 0.0 : 300.0};
      return p;
    };
  };
  const MotionReport made = report(rig, 101, 0.01, walk(0));
  EXPECT_NEAR(made.ground.y(), 400, 1e-9);
  // But for the two steps down from the air, which go against the ground.
  for (const FootSliding& foot : made.feet) EXPECT_NEAR(foot.mean_mm_per_s, 2 * 800.0 / 53, 1e-6);
  EXPECT_GT(report(rig, 101, 0.01, walk(50)).feet[0].worst_mm_per_s, 4000)
      << "a slip is one on a treadmill, too";
  const auto gone = [&](std::size_t frame) {
    Pose p = walk(0)(frame);
    p.root_translation.y() += 4.0 * static_cast<double>(frame);
    return p;
  };
  EXPECT_EQ(report(rig, 101, 0.01, gone).ground, Eigen::Vector2d::Zero())
      << "who gets on has a ground that stays";
}

// A clip's elbow twists a little in every frame, and stands on its limit within what is printed as 0.0:
// neither passes it.
TEST(MotionReport, TurnsThatAHingeCannotMakePassNoLimit) {
  Rig rig = test::legs();
  Joint& knee = rig.skeleton.segments[2].joint;
  knee.kind = JointKind::hinge;
  knee.sequence[0].min = 0;
  knee.sequence[0].max = 60 * kDegree;
  const auto pose = [&](std::size_t frame) {
    Pose p = Pose::rest(7);
    const double bend = frame == 7 ? 75 : frame % 2 == 0 ? 60.3 : 30;
    p.rotation[2] = rotation_from_angles(knee, {bend * kDegree, 4 * kDegree, 3 * kDegree});
    return p;
  };
  const MotionReport made = report(rig, 10, 0.01, pose);
  ASSERT_EQ(made.limits.size(), 1U);
  EXPECT_NEAR(made.limits[0].share, 0.1, 1e-12);
  EXPECT_NEAR(made.limits[0].worst, 15 * kDegree, 0.5 * kDegree);
}

}  // namespace
}  // namespace ecorche::kinematics
