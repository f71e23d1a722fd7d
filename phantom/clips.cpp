// SPDX-License-Identifier: Apache-2.0
#include "phantom/clips.hpp"

#include <cmath>
#include <initializer_list>
#include <map>
#include <string>

#include <ecorche/values/transform.hpp>

namespace ecorche::phantom {

namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846, kDegree = kPi / 180;

/// A bump of height 1 around phase `at`, of period 1.
double bump(double phase, double at, double width) {
  const double d = std::sin(kPi * (phase - at)) / kPi;
  return std::exp(-d * d / (width * width));
}

/// One frame: anatomical angles, degrees from rest, by joint and angle name.
using Angles = std::map<std::string, std::map<std::string, double>>;

/// The turn from rest, about axes parallel to LPS, of a joint whose angles differ from rest by `degrees`.
Eigen::Quaterniond turn(const Joint& joint, const std::map<std::string, double>& degrees) {
  Eigen::Quaterniond rest = Eigen::Quaterniond::Identity(), posed = rest;
  for (const AngleAxis& angle : joint.sequence) {
    const auto found = degrees.find(angle.name);
    const double more = found == degrees.end() ? 0 : found->second * kDegree;
    rest = rest * Eigen::AngleAxisd(angle.sign * angle.rest, Vector3d::Unit(angle.axis));
    posed = posed * Eigen::AngleAxisd(angle.sign * (angle.rest + more), Vector3d::Unit(angle.axis));
  }
  const Eigen::Quaterniond axes(joint.axes);
  return (axes * rest.conjugate() * posed * axes.conjugate()).normalized();
}

/// A clip's joint for every segment, under the segment's first alias; each rotation is filled by add_frame.
Clip empty_clip(const Skeleton& truth, std::string name) {
  Clip clip;
  clip.name = std::move(name);
  for (const Segment& segment : truth.segments) {
    ClipJoint joint;
    joint.name = segment.aliases.front();
    joint.parent = segment.parent;
    joint.offset = segment.joint.center;
    if (segment.parent >= 0)
      joint.offset -= truth.segments[static_cast<std::size_t>(segment.parent)].joint.center;
    clip.joints.push_back(joint);
  }
  return clip;
}

void add_frame(const Skeleton& truth, const Angles& angles, const Vector3d& root, Clip& clip) {
  for (const Segment& segment : truth.segments) {
    const auto found = angles.find(segment.joint.name);
    clip.rotation.push_back(found == angles.end() ? Eigen::Quaterniond::Identity()
                                                  : turn(segment.joint, found->second));
  }
  clip.root_position.push_back(root);
}

/// Where the ankle of one side comes to lie when the root stays.
Vector3d ankle_at(const Skeleton& truth, const Angles& angles, const std::string& ankle) {
  std::vector<RigidTransform> global(truth.segments.size());
  for (std::size_t i = 0; i < truth.segments.size(); ++i) {
    const Segment& segment = truth.segments[i];
    const auto found = angles.find(segment.joint.name);
    const Eigen::Quaterniond q =
        found == angles.end() ? Eigen::Quaterniond::Identity() : turn(segment.joint, found->second);
    const RigidTransform local{q, segment.joint.center - q * segment.joint.center};
    global[i] = segment.parent < 0 ? local : global[static_cast<std::size_t>(segment.parent)] * local;
    if (segment.joint.name == ankle) return global[i] * segment.joint.center;
  }
  return Vector3d::Zero();
}

}  // namespace

Clip make_walk(const Skeleton& truth) {
  Clip clip = empty_clip(truth, "walk");
  constexpr int stride = 36, strides = 2;
  const Vector3d rest = truth.segments.front().joint.center;
  for (int frame = 0; frame < stride * strides; ++frame) {
    const double t = static_cast<double>(frame) / stride;
    const double swing = std::cos(2 * kPi * t);  // 1 when the left heel strikes
    Angles angles;
    for (const bool left : {true, false}) {
      const std::string end = left ? "_left" : "_right";
      const double p = left ? t : t + 0.5, s = left ? swing : -swing;
      angles["hip" + end] = {{"flexion", 8 + 20 * std::cos(2 * kPi * (p + 0.04))},
                             {"adduction", 3 * bump(p, 0.25, 0.12)}};
      angles["knee" + end] = {{"flexion", 4 + 13 * bump(p, 0.14, 0.09) + 54 * bump(p, 0.73, 0.10)}};
      angles["ankle" + end] = {
          {"dorsiflexion", 9 * bump(p, 0.42, 0.13) - 17 * bump(p, 0.63, 0.07) - 5 * bump(p, 0.07, 0.05)}};
      angles["toe_joint" + end] = {{"extension", 25 * bump(p, 0.58, 0.07)}};
      angles["shoulder" + end] = {{"flexion", 3 - 17 * s}};
      angles["elbow" + end] = {{"flexion", 14 - 9 * s}};
    }
    angles["pelvis"] = {{"rotation", -5 * swing}, {"obliquity", 2.5 * std::sin(2 * kPi * t)}};
    angles["lumbosacral"] = {
        {"flexion", 2}, {"rotation", 4 * swing}, {"lateral_bending", -2 * std::sin(2 * kPi * t)}};
    angles["thoracolumbar"] = {{"rotation", 5 * swing}};
    angles["cervicothoracic"] = {{"rotation", -2 * swing}};
    angles["atlantooccipital"] = {{"rotation", -2 * swing}};
    // Lowest in double support, shifted over the standing leg.
    add_frame(truth, angles, rest + Vector3d(12 * std::sin(2 * kPi * t), 0, -16 - 12 * std::cos(4 * kPi * t)),
              clip);
  }
  return clip;
}

Clip make_bend(const Skeleton& truth) {
  Clip clip = empty_clip(truth, "bend");
  constexpr int frames = 120;
  const Vector3d rest = truth.segments.front().joint.center;
  const int ankle = truth.find_joint("ankle_left");
  for (int frame = 0; frame < frames; ++frame) {
    const double u = 0.5 - 0.5 * std::cos(2 * kPi * frame / frames);  // 0 upright, 1 all the way down
    const double look = std::sin(2 * kPi * frame / frames);
    Angles angles;
    angles["pelvis"] = {{"tilt", 22 * u}};
    angles["lumbosacral"] = {{"flexion", 34 * u}};
    angles["thoracolumbar"] = {{"flexion", 18 * u}, {"rotation", 6 * look}};
    angles["cervicothoracic"] = {{"flexion", -8 * u}, {"rotation", 18 * look}};
    angles["atlantooccipital"] = {{"flexion", -6 * u}, {"rotation", 22 * look}};
    for (const std::string end : {"_left", "_right"}) {
      angles["hip" + end] = {{"flexion", 46 * u}};
      angles["knee" + end] = {{"flexion", 40 * u}};
      angles["ankle" + end] = {{"dorsiflexion", 16 * u}};
      angles["sternoclavicular" + end] = {{"protraction", 8 * u}};
      angles["shoulder" + end] = {{"flexion", 72 * u}};
      angles["elbow" + end] = {{"flexion", 18 * u}};
      angles["wrist" + end] = {{"flexion", -15 * u}};
    }
    // The ankles stay where they stand.
    const Vector3d moved =
        ankle_at(truth, angles, "ankle_left") - truth.segments[static_cast<std::size_t>(ankle)].joint.center;
    add_frame(truth, angles, rest - Vector3d(0, moved.y(), moved.z()), clip);
  }
  return clip;
}

}  // namespace ecorche::phantom
