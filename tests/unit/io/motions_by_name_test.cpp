// SPDX-License-Identifier: Apache-2.0
// Poses by name: the library on the example bodies, pose sequences, motion maps.
#include <gtest/gtest.h>

#include <numbers>

#include <ecorche/io/case_file.hpp>
#include <ecorche/io/pose_library.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "io/case/ik_file.hpp"
#include "io/case/motion_map.hpp"
#include "io/case/pose_sequence.hpp"
#include "tests/unit/io/scratch.hpp"

namespace ecorche::io {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kInRadians = std::numbers::pi / 180;

Rig rig_of(const std::string& example) {
  return {read_skeleton(std::string(ECORCHE_SOURCE) + "/examples/" + example + "/skeleton.yaml"), {}};
}

double degrees(const Rig& rig, const Pose& pose, const std::string& joint, std::size_t angle) {
  const auto row = static_cast<std::size_t>(rig.skeleton.find_joint(joint));
  return kinematics::angles_from_rotation(rig.skeleton.segments.at(row).joint, pose.rotation.at(row))[angle] /
         kInRadians;
}

TEST(PoseLibrary, AnglesMeanTheSameOnEveryBody) {
  EXPECT_EQ(library_poses(), (std::vector<std::string>{"anatomical", "arms_up", "lateral", "lithotomy",
                                                       "prone", "sitting", "squatting", "supine"}));
  for (const char* body : {"bodyparts3d", "icrp110_female"}) {
    const Rig rig = rig_of(body);
    for (const std::string& name : library_poses()) {
      const LibraryPose pose = library_pose(name, rig);
      ASSERT_EQ(pose.pose.rotation.size(), rig.skeleton.segments.size());
      // Every pose is one that the body can do.
      Pose done = pose.pose;
      std::vector<ClampedJoint> clamped;
      kinematics::constrain(rig.skeleton, done, clamped);
      for (const ClampedJoint& c : clamped)
        EXPECT_LT(c.removed, 11 * kInRadians)
            << body << " " << name << " "
            << rig.skeleton.segments[static_cast<std::size_t>(c.joint)].joint.name;
    }
    const Pose sitting = library_pose("sitting", rig).pose;
    for (const std::string side : {"_left", "_right"}) {
      EXPECT_NEAR(degrees(rig, sitting, "hip" + side, 0), 85, 1e-9) << body;
      EXPECT_NEAR(degrees(rig, sitting, "knee" + side, 0), 90, 1e-9) << body;
    }
    const LibraryPose squatting = library_pose("squatting", rig);
    EXPECT_NEAR(degrees(rig, squatting.pose, "lumbosacral", 0), 15, 1e-9) << body << ": in the middle";
    EXPECT_EQ(squatting.left_out, std::vector<std::string>{}) << body;
  }
  // The woman's hips abduct where the other's adduct.
  const Rig woman = rig_of("icrp110_female"), man = rig_of("bodyparts3d");
  EXPECT_NEAR(degrees(woman, library_pose("lithotomy", woman).pose, "hip_left", 1), 30, 1e-9);
  EXPECT_NEAR(degrees(man, library_pose("lithotomy", man).pose, "hip_left", 1), -30, 1e-9);
}

// Which way of the patient points down to the floor, -z.
TEST(PoseLibrary, BodiesLieAsTheirPoseSays) {
  const Rig rig = rig_of("bodyparts3d");
  const auto down = [&](const char* name) {
    return Vector3d(library_pose(name, rig).pose.rotation[0].conjugate() * Vector3d(0, 0, -1));
  };
  EXPECT_LT((down("supine") - Vector3d(0, 1, 0)).norm(), 1e-9) << "posterior";
  EXPECT_LT((down("prone") - Vector3d(0, -1, 0)).norm(), 1e-9) << "anterior";
  EXPECT_LT((down("lateral") - Vector3d(-1, 0, 0)).norm(), 1e-9) << "right";
  EXPECT_LT((down("lithotomy") - Vector3d(0, 1, 0)).norm(), 1e-9);
  EXPECT_LT((down("sitting") - Vector3d(0, 0, -1)).norm(), 1e-9);
}

TEST(PoseLibrary, WhatABodyHasNotIsSaid) {
  Rig leg = rig_of("right_leg");
  const LibraryPose pose = library_pose("sitting", leg);
  EXPECT_NEAR(degrees(leg, pose.pose, "knee_right", 0), 90, 1e-9);
  EXPECT_NE(std::find(pose.left_out.begin(), pose.left_out.end(), "elbow_left.flexion"), pose.left_out.end());
  for (Segment& segment : leg.skeleton.segments) segment.joint.name += "_of_mine";
  expect_error(ErrorKind::config, "has none of the joints of the pose 'sitting'",
               [&] { library_pose("sitting", leg); });
  expect_error(ErrorKind::usage, "has no pose 'siting' (it has anatomical, arms_up",
               [&] { library_pose("siting", leg); });
}

constexpr const char* kSequence = R"(ecorche_pose_sequence: 1
skeleton: bodyparts3d
frames_per_second: 10
keys:
  - {time_s: 0}
  - {time_s: 1, pose: lib:sitting}
  - {time_s: 1.5, joints: {knee_left: {flexion_deg: 30}}, root: {translation_mm: [0, 0, 50]}}
  - {time_s: 3, pose: bent.yaml}
)";

TEST(PoseSequence, KeysAndWhatLiesBetween) {
  const Scratch scratch;
  const Rig rig = rig_of("bodyparts3d");
  scratch.put("bent.yaml",
              "ecorche_pose: 1\nskeleton: bodyparts3d\njoints: {knee_left: {flexion_deg: 120}}\n");
  const PoseSequence read = read_pose_sequence(scratch.put("way.yaml", kSequence), rig);
  ASSERT_EQ(read.frames(), 31U);
  EXPECT_NEAR(degrees(rig, read.at(5), "knee_left", 0), 45, 1e-9);
  EXPECT_NEAR(degrees(rig, read.at(10), "knee_left", 0), 90, 1e-9);
  EXPECT_NEAR(degrees(rig, read.at(15), "knee_left", 0), 30, 1e-9);
  EXPECT_NEAR(degrees(rig, read.at(20), "knee_left", 0), 60, 1e-9);
  EXPECT_NEAR(degrees(rig, read.at(30), "knee_left", 0), 120, 1e-9);
  EXPECT_NEAR(read.at(15).root_translation.z(), 50, 1e-9);
}

TEST(PoseSequence, EveryMistakeIsNamed) {
  const Scratch scratch;
  const Rig rig = rig_of("bodyparts3d");
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part,
                           ErrorKind kind = ErrorKind::config) {
    std::string text = kSequence;
    text.replace(text.find(from), from.size(), to);
    expect_error(kind, part, [&] { read_pose_sequence(scratch.put("way.yaml", text), rig); });
  };
  refused("sequence: 1", "sequence: 2", "way.yaml:1:ecorche_pose_sequence: version '2' is not known");
  refused("bodyparts3d", "woman", "this pose is for the skeleton 'woman'");
  refused("second: 10", "second: 0", "is 0 (write 0.1 to 1000");
  refused("time_s: 1,", "time_s: 0,", "way.yaml:6:keys[1].time_s: is not after the key before");
  refused("time_s: 1,", "time_s: -1,", "is -1");
  refused("lib:sitting", "lib:siting", "has no pose 'siting'", ErrorKind::usage);
  refused("pose: lib:sitting", "pose: lib:sitting, joints: {}", "also gives root or joints");
  refused("knee_left", "knee_lft", "did you mean 'knee_left'?");
  refused("bent.yaml", "none.yaml", "none.yaml", ErrorKind::missing_input);
  refused("skeleton: bodyparts3d", "skeleton: bodyparts3d\nease: bouncy",
          "unknown ease 'bouncy' (use linear, smooth)");
  refused("time_s: 1,", "time_s: 1000000,", "is 1000000 (write 0 to 100000 seconds)");
  const std::string whole = kSequence, head = whole.substr(0, whole.find("keys:"));
  std::string many = head + "keys:\n";
  for (int k = 0; k < 100001; ++k) many += "  - {time_s: 0}\n";
  refused(kSequence, head + "keys: []\n", "keys: is empty (write at least one key)");
  refused(kSequence, many, "keys: has 100001 keys (100000 are the most)");
}

TEST(MotionMap, WhatNamesMean) {
  const Scratch scratch;
  const Rig rig = rig_of("bodyparts3d");
  const MotionMap map = read_motion_map(scratch.put("map.yaml", R"(ecorche_motion_map: 1
joints: {Bip Knee: shank_left, Tail:}
angles: {knee: [{joint: knee_left, angle: flexion, scale: -1}]}
markers: {RKNE: knee_right, SACR: {segment: pelvis, point: [0, 40, 900]}}
)"),
                                        rig);
  EXPECT_EQ(map.joints.at("Bip Knee"), "shank_left");
  EXPECT_EQ(map.joints.at("Tail"), "");
  EXPECT_EQ(map.angles.at("knee").at(0).scale, -1);
  EXPECT_EQ(
      map.markers.at("RKNE").point,
      rig.skeleton.segments[static_cast<std::size_t>(rig.skeleton.find_joint("knee_right"))].joint.center);
  EXPECT_EQ(map.markers.at("SACR").row, 0U);
  EXPECT_EQ(opensim_map(rig).angles.at("ankle_angle_r").at(0).angle.sign, 1);
  EXPECT_EQ(opensim_map(rig).angles.at("lumbar_extension").size(), 2U);
  EXPECT_EQ(opensim_map(rig_of("icrp110_female")).angles.at("hip_adduction_l").at(0).angle.sign, -1);
  const auto refused = [&](const std::string& text, const std::string& part) {
    expect_error(ErrorKind::config, part,
                 [&] { read_motion_map(scratch.put("map.yaml", "ecorche_motion_map: 1\n" + text), rig); });
  };
  refused("joints: {Knee: shank_lft}", "unknown segment 'shank_lft' (did you mean 'shank_left'?)");
  refused("angles: {k: [{joint: knee_left, angle: rotation}]}",
          "map.yaml:2:angles.k[0].angle: unknown angle");
  refused("angles: {k: [{joint: nee_left, angle: flexion}]}",
          "unknown joint 'nee_left' (did you mean 'knee_left'?)");
  refused("angles: {k: [{joint: knee_left, angle: flecion}]}",
          "unknown angle 'flecion' (did you mean 'flexion'?)");
  refused("angles: {k: [{joint: knee_left, angle: flexion, scale: 1e6}]}",
          "scale: is too large (write a factor such as -1)");
  refused("markers: {A: hop_left}", "unknown joint 'hop_left' (did you mean 'hip_left'?)");
  refused("markers: {A: {segment: thorx, point: [0, 0, 0]}}", "did you mean 'thorax'?");
  refused("bones: {}", "unknown key 'bones'");
}

TEST(Docs, TheExamplesOfMotionAreRead) {
  const Scratch scratch;
  std::ifstream page(ECORCHE_SOURCE "/docs/reference/motion.md", std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(page), {});
  const auto block = [&](const std::string& first) {
    const std::size_t begin = text.find("```yaml\n" + first) + 8;
    return text.substr(begin, text.find("```", begin) - begin);
  };
  scratch.put("pose.yaml", "ecorche_pose: 1\nskeleton: right_leg\n");
  const auto map =
      read_motion_map(scratch.put("map.yaml", block("ecorche_motion_map")), rig_of("bodyparts3d"));
  EXPECT_EQ(map.joints.at("Bip01 L Calf"), "shank_left");
  const auto sequence =
      read_pose_sequence(scratch.put("way.yaml", block("ecorche_pose_sequence")), rig_of("right_leg"));
  EXPECT_EQ(sequence.frames(), 91U);
  const IkRequest ik = read_ik(scratch.put("ik.yaml", block("ecorche_ik")), rig_of("bodyparts3d"));
  EXPECT_EQ(ik.problem.targets.size(), 3U);
  EXPECT_EQ(ik.problem.looks.size(), 1U);
}

TEST(IkFile, PinsAreWhereTheStartHasThem) {
  const Scratch scratch;
  const Rig rig = rig_of("right_leg");
  scratch.put("bent.yaml", "ecorche_pose: 1\nskeleton: right_leg\njoints: {knee_right: {flexion_deg: 60}}\n");
  const std::string text =
      "ecorche_ik: 1\nskeleton: right_leg\nstart: bent.yaml\npinned: [{segment: shank_right, point: [-80, "
      "-60, 100]}]\n"
      "targets: [{segment: thigh_right, point: [0, 0, 500], goal: [1, 2, 3], weight: 5}]\n";
  const IkRequest read = read_ik(scratch.put("ik.yaml", text), rig);
  const auto motion = kinematics::forward(rig, read.start);
  ASSERT_EQ(read.problem.targets.size(), 2U);
  EXPECT_EQ(read.problem.targets[0].weight, 5);
  EXPECT_EQ(read.problem.targets[0].goal, Vector3d(1, 2, 3));
  EXPECT_LT((read.problem.targets[1].goal - motion[1] * Vector3d(-80, -60, 100)).norm(), 1e-9);
  EXPECT_GT((read.problem.targets[1].goal - Vector3d(-80, -60, 100)).norm(), 100);
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& part) {
    std::string wrong = text;
    wrong.replace(wrong.find(from), from.size(), to);
    expect_error(ErrorKind::config, part, [&] { read_ik(scratch.put("ik.yaml", wrong), rig); });
  };
  refused("thigh_right", "tigh_right",
          "ik.yaml:5:targets[0].segment: unknown segment 'tigh_right' (did you mean");
  refused("weight: 5", "weight: 0", "targets[0].weight: is 0 (write a number above 0, 1000 at most)");
  refused("goal: [1, 2, 3]", "goal: [1, 2]", "has 2 values");
  refused("goal: [1, 2, 3]", "goal: [1, 2, .inf]", "goal");
  std::string many = "pinned: [{segment: shank_right}";
  for (int i = 0; i < 1000; ++i) many += ", {segment: shank_right}";
  refused("pinned: [{segment: shank_right, point: [-80, -60, 100]}", many,
          "has 1001 entries (1000 are the most)");
  refused("goal:", "gaol:", "did you mean 'goal'?");
  refused("skeleton: right_leg", "skeleton: right_leg\nmove_root: maybe",
          "move_root: unknown value 'maybe' (use true, false)");
  refused("skeleton: right_leg", "skeleton: left_leg", "this pose is for the skeleton 'left_leg'");
  expect_error(ErrorKind::config, "asks for nothing",
               [&] { read_ik(scratch.put("none.yaml", "ecorche_ik: 1\nskeleton: right_leg\n"), rig); });
}

}  // namespace
}  // namespace ecorche::io
