// SPDX-License-Identifier: Apache-2.0
// Templates on bodies made for them: a four-legged animal of sticks, and one leg scanned in two poses.
#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <set>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/values/pose.hpp>
#include "io/case/case_rules.hpp"
#include "io/case/skeleton_file.hpp"
#include "phantom/body.hpp"
#include "phantom/bones.hpp"
#include "phantom/isosurface.hpp"
#include "preprocess/rig/fit_rig.hpp"
#include "tests/unit/rig/balls.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

Rig fitted(const std::string& name, const std::vector<CaseBone>& bones) {
  io::PlacedSkeleton placed =
      io::parse_skeleton(io::yaml::Value::parse(io::skeleton_template(name).value(), name), io::Frame{});
  Case patient;
  patient.name = name;
  patient.skeleton = placed.skeleton;
  patient.bones = bones;
  io::place_regions({}, placed.regions, patient);
  return fit(patient, {});
}

const Joint& joint_of(const Rig& rig, const std::string& name) {
  return rig.skeleton.segments.at(static_cast<std::size_t>(rig.skeleton.find_joint(name))).joint;
}

constexpr double kThick = 12;  // mm, radius of a stick

/// Balls in a row: its ends lie 1 mm short of a and b.
SurfaceMesh stick(const Vector3d& a, const Vector3d& b) {
  const Vector3d along = (b - a).normalized();
  const double length = (b - a).norm() - 2 * (kThick + 1);
  const int count = 1 + static_cast<int>(std::ceil(length / kThick));
  SurfaceMesh bone;
  for (int i = 0; i < count; ++i) {
    const Vector3d at = a + (kThick + 1 + length * i / std::max(1, count - 1)) * along;
    const SurfaceMesh part = test::ball(at, kThick, 12);
    bone = i == 0 ? part : test::joined(bone, part);
  }
  return bone;
}

TEST(Quadruped, joints_lie_where_its_bones_meet) {
  // Head to the front (-y), 0.6 m high; each bone from its joint to the next.
  const std::vector<std::tuple<std::string, std::string, Vector3d, Vector3d>> trunk{
      {"lumbar", "lumbosacral", {0, 250, 560}, {0, 80, 570}},
      {"thorax", "thoracolumbar", {0, 80, 570}, {0, -200, 560}},
      {"neck", "cervicothoracic", {0, -200, 560}, {0, -300, 680}},
      {"head", "atlantooccipital", {0, -300, 680}, {0, -460, 640}},
      {"tail", "sacrocaudal", {0, 350, 550}, {0, 550, 450}}};
  std::vector<CaseBone> bones{{"pelvis_bone", "pelvis", stick({0, 350, 550}, {0, 250, 560})}};
  std::map<std::string, Vector3d> truth;
  for (const auto& [segment, joint, from, to] : trunk) {
    bones.push_back({segment + "_bone", segment, stick(from, to)});
    truth[joint] = from;
  }
  for (const double side : {1.0, -1.0}) {
    const std::string end = side > 0 ? "_left" : "_right";
    const std::vector<std::tuple<std::string, std::string, Vector3d, Vector3d>> legs{
        {"scapula", "scapulothoracic", {13, -120, 564}, {80, -190, 420}},
        {"upper_arm", "shoulder", {80, -190, 420}, {80, -110, 290}},
        {"forearm", "elbow", {80, -110, 290}, {80, -130, 110}},
        {"forepaw", "carpus", {80, -130, 110}, {80, -160, 10}},
        {"thigh", "hip", {13, 300, 555}, {80, 240, 380}},
        {"shank", "knee", {80, 240, 380}, {80, 330, 220}},
        {"hindpaw", "hock", {80, 330, 220}, {80, 300, 20}}};
    for (const auto& [segment, joint, from, to] : legs) {
      const auto mirrored = [&](const Vector3d& p) -> Vector3d { return {side * p.x(), p.y(), p.z()}; };
      bones.push_back({segment + "_bone" + end, segment + end, stick(mirrored(from), mirrored(to))});
      truth[joint + end] = mirrored(from);
    }
  }
  const Rig rig = fitted("quadruped", bones);
  EXPECT_EQ(rig.skeleton.segments.size(), 20U);  // it opens no mouth
  for (const auto& [name, at] : truth) {
    const Joint& joint = joint_of(rig, name);
    EXPECT_LT((joint.center - at).norm(), 2 * (kThick + 1)) << name;  // a bone's thickness and the gap
    for (const AngleAxis& angle : joint.sequence) EXPECT_TRUE(std::isfinite(angle.rest)) << name;
  }
}

/// The phantom's left leg with `bend` more flexion of the knee than it stands with.
struct Leg {
  phantom::Landmarks at = phantom::make_landmarks(3);
  Eigen::AngleAxisd bend;
  Vector3d ankle;
  std::vector<CaseBone> bones;
  explicit Leg(double radians) : bend(radians, at.knee_axis) {
    ankle = moved(at.ankle);
    const std::set<std::string> below{"shank_left", "foot_left"};
    for (const phantom::Part& part : phantom::make_bones(at)) {
      if (part.mirror_of >= 0) continue;
      const bool shank = below.contains(part.segment);
      if (!shank && part.segment != "pelvis" && part.segment != "thigh_left") continue;
      bones.push_back({part.name, part.segment, phantom::isosurface(part.shape, 4, {})});
      Points& V = bones.back().surface.V;
      for (Eigen::Index v = 0; v < V.rows() && shank; ++v) V.row(v) = moved(V.row(v).transpose()).transpose();
    }
  }
  Vector3d moved(const Vector3d& p) const { return at.knee + bend * (p - at.knee); }
};

// Ninety degrees are ninety degrees, however the knee was scanned: at the knee, seen along its true axis.
TEST(Human, ninety_degrees_of_the_knee_are_the_same_from_every_scan) {
  std::vector<double> rests;
  for (const double scanned : {0.0, 0.2, 0.45}) {
    const Leg leg(scanned);
    const Rig rig = fitted("human", leg.bones);
    const Joint& knee = joint_of(rig, "knee_left");
    rests.push_back(knee.sequence[0].rest);
    const Eigen::Matrix3d turn =
        knee.axes *
        kinematics::rotation_from_angles(
            knee, {std::numbers::pi / 2, knee.sequence[1].rest, knee.sequence[2].rest}) *
        knee.axes.transpose();
    const auto flat = [&](const Vector3d& line) -> Vector3d {
      return (line - leg.at.knee_axis * leg.at.knee_axis.dot(line)).normalized();
    };
    const Vector3d up = flat(leg.at.hip - leg.at.knee),
                   down = flat(knee.center + turn * (leg.ankle - knee.center) - leg.at.knee);
    EXPECT_NEAR(std::acos(up.dot(down)) * 180 / std::numbers::pi, 90, 1.5) << scanned;
    EXPECT_GT(down.y(), 0.9) << "the heel goes back";
  }
  EXPECT_NEAR(rests[1] - rests[0], 0.2, 0.02);
  EXPECT_NEAR(rests[2] - rests[0], 0.45, 0.02);
}

// The rhythms are data of the template: an arm raised to the side takes its girdle with it, a knee that bends
// slides back, a patella follows; and one line more in each segment bends a spine along all of it.
TEST(Human, rhythms_of_the_template_move_what_follows) {
  std::string text = io::skeleton_template("human").value();
  const auto couple = [&](const std::string& joint, const std::string& ratio) {
    const std::size_t at = text.find("rest_deg: measured", text.find("name: " + joint));
    text.insert(
        at, "coupled: [{joint: lumbosacral, angle: flexion, drives: flexion, ratio: " + ratio + "}]\n      ");
  };
  couple("thoracolumbar", "0.6");
  couple("cervicothoracic", "0.3");
  const Skeleton human = io::parse_skeleton(io::yaml::Value::parse(text, "human"), io::Frame{}).skeleton;
  const auto row = [&](const std::string& joint) {
    return static_cast<std::size_t>(human.find_joint(joint));
  };
  const auto bent = [&](const std::string& joint, const std::array<double, 3>& angles) {
    return kinematics::rotation_from_angles(human.segments[row(joint)].joint, angles);
  };
  Pose pose = Pose::rest(human.segments.size());
  pose.rotation[row("shoulder_left")] = bent("shoulder_left", {0, -1.2, 0});
  pose.rotation[row("knee_right")] = bent("knee_right", {1.5, 0, 0});
  pose.rotation[row("lumbosacral")] = bent("lumbosacral", {0.5, 0, 0});
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(human, pose, clamped);
  EXPECT_TRUE(clamped.empty());
  const auto angles = [&](const std::string& joint) {
    return kinematics::angles_from_rotation(human.segments[row(joint)].joint, pose.rotation[row(joint)]);
  };
  EXPECT_NEAR(angles("sternoclavicular_left")[1], -0.25 * 1.2, 1e-9);  // depression: it rises
  EXPECT_NEAR(angles("sternoclavicular_left")[0], 0.17 * 1.2, 1e-9);
  EXPECT_NEAR(angles("sternoclavicular_right")[1], 0, 1e-9);
  EXPECT_NEAR(pose.translation[row("knee_right")].y(), -2.5 * 1.5, 1e-9);
  EXPECT_NEAR(angles("thoracolumbar")[0], 0.3, 1e-9);
  EXPECT_NEAR(angles("cervicothoracic")[0], 0.15, 1e-9);
}

}  // namespace
}  // namespace ecorche::rig
