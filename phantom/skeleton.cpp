// SPDX-License-Identifier: Apache-2.0
// The virtual skeleton of the phantom: 21 segments with the names of the `human` template, whose jaw it
// lacks; anatomical angles, normal ranges.
#include <cmath>
#include <initializer_list>
#include <numbers>

#include "phantom/body.hpp"

namespace ecorche::phantom {

namespace {

/// As a reader of degrees rounds them, so that the files say 30 and not 29.999999999999997.
double radians(double degrees) {
  return static_cast<double>(degrees * (std::numbers::pi_v<long double> / 180));
}

constexpr const char* kRanges = "AAOS, Joint Motion (1965), normal adult ranges, rounded";
constexpr const char* kSpineRanges = "White and Panjabi, Clinical Biomechanics of the Spine (1990), rounded";

struct Range {
  const char* name;
  int axis;
  double sign, min_deg, max_deg;
};

class Builder {
 public:
  explicit Builder(bool patient) : patient_(patient) { skeleton_.name = "phantom"; }

  /// Adds a segment whose joint frame at rest is `axes`.
  Joint& add(const std::string& name, const std::string& parent, const std::string& joint, JointKind kind,
             const Vec& center, const Eigen::Matrix3d& axes, std::initializer_list<Range> ranges,
             std::vector<std::string> aliases) {
    Segment segment;
    segment.name = name;
    segment.parent = parent.empty() ? -1 : skeleton_.find_segment(parent);
    segment.joint.name = joint;
    segment.joint.kind = kind;
    segment.joint.center = center;
    segment.joint.axes = axes;
    for (const Range& range : ranges) {
      AngleAxis angle;
      angle.name = range.name;
      angle.axis = range.axis;
      angle.sign = range.sign;
      angle.min = radians(range.min_deg);
      angle.max = radians(range.max_deg);
      segment.joint.sequence.push_back(angle);
    }
    segment.joint.limits_source = kRanges;
    segment.aliases = std::move(aliases);
    skeleton_.segments.push_back(std::move(segment));
    return skeleton_.segments.back().joint;
  }

  /// In the patient the centre is to be found from the bones.
  void by_sphere(Joint& joint, const std::string& bone, const std::string& facing) const {
    if (!patient_) return;
    joint.rule = CenterRule::sphere_fit;
    joint.center.setZero();
    joint.center_bone = bone;
    joint.facing_bone = facing;
  }

  Skeleton take() { return std::move(skeleton_); }

 private:
  bool patient_;
  Skeleton skeleton_;
};

/// Mirrors a frame of the left side: turns about x keep their sign, those about y and z change it.
Eigen::Matrix3d mirrored_frame(const Eigen::Matrix3d& left) {
  const Vec flip(-1, 1, 1);
  Eigen::Matrix3d right;
  right.col(0) = -flip.cwiseProduct(left.col(0));
  right.col(1) = flip.cwiseProduct(left.col(1));
  right.col(2) = flip.cwiseProduct(left.col(2));
  return right;
}

/// Rest angles of an x, y, z sequence whose frame is parallel to LPS when all are zero: axes = Rx Ry Rz.
void rest_from_axes(Joint& joint) {
  const Eigen::Matrix3d& r = joint.axes;
  const double turns[3] = {std::atan2(-r(1, 2), r(2, 2)), std::asin(r(0, 2)), std::atan2(-r(0, 1), r(0, 0))};
  for (std::size_t i = 0; i < 3; ++i) {
    joint.sequence[i].rest = std::abs(turns[i]) < 1e-9 ? 0 : joint.sequence[i].sign * turns[i];
  }
}

void add_arm(Builder& build, const Landmarks& at, bool left) {
  const std::string end = left ? "_left" : "_right", alias = left ? "Left" : "Right",
                    small = left ? "left" : "right";
  const double side = left ? 1 : -1;
  const auto point = [&](const Vec& p) -> Vec { return {side * p.x(), p.y(), p.z()}; };
  const auto frame = [&](const Eigen::Matrix3d& f) -> Eigen::Matrix3d {
    return left ? f : mirrored_frame(f);
  };
  const Eigen::Matrix3d upper = frame_xz(at.elbow_axis, at.shoulder - at.elbow),
                        fore = frame_xz(at.elbow_axis, at.elbow - at.wrist);

  build.add("girdle" + end, "thorax", "sternoclavicular" + end, JointKind::ball, point(at.sternoclavicular),
            Eigen::Matrix3d::Identity(),
            {{"axial_rotation", 0, -1, -10, 45},
             {"depression", 1, side, -45, 10},
             {"protraction", 2, -side, -30, 30}},
            {alias + "Shoulder", small + "Shoulder", small + "Clavicle"});
  Joint& shoulder = build.add(
      "upper_arm" + end, "girdle" + end, "shoulder" + end, JointKind::ball, point(at.shoulder), frame(upper),
      // Of an arm's 180 degrees of elevation 120 are the shoulder's, the others the girdle's (Inman et al.
      // 1944).
      {{"flexion", 0, -1, -60, 180}, {"adduction", 1, side, -120, 45}, {"rotation", 2, -side, -90, 90}},
      {alias + "Arm", small + "UpperArm"});
  rest_from_axes(shoulder);
  build.by_sphere(shoulder, "humerus" + end, "scapula" + end);
  Joint& elbow = build.add(
      "forearm" + end, "upper_arm" + end, "elbow" + end, JointKind::hinge, point(at.elbow), frame(fore),
      {{"flexion", 0, -1, 0, 150}, {"adduction", 1, side, 0, 0}, {"rotation", 2, -side, 0, 0}},
      {alias + "ForeArm", small + "LowerArm"});
  elbow.sequence[0].rest = at.elbow_flexion;
  // The hand's frame: x towards the back of the hand, y to the little finger, z to the elbow.
  build.add("hand" + end, "forearm" + end, "wrist" + end, JointKind::universal, point(at.wrist),
            frame(at.hand),
            {{"flexion", 1, side, -70, 80}, {"deviation", 0, 1, -20, 30}, {"rotation", 2, -side, 0, 0}},
            {alias + "Hand", small + "Hand"});
}

void add_leg(Builder& build, const Landmarks& at, bool left) {
  const std::string end = left ? "_left" : "_right", alias = left ? "Left" : "Right",
                    small = left ? "left" : "right";
  const double side = left ? 1 : -1;
  const auto point = [&](const Vec& p) -> Vec { return {side * p.x(), p.y(), p.z()}; };
  const auto frame = [&](const Eigen::Matrix3d& f) -> Eigen::Matrix3d {
    return left ? f : mirrored_frame(f);
  };
  const Eigen::Matrix3d thigh = frame_xz(at.knee_axis, at.hip - at.knee),
                        shank = frame_xz(at.knee_axis, at.knee - at.ankle);

  Joint& hip = build.add(
      "thigh" + end, "pelvis", "hip" + end, JointKind::ball, point(at.hip), frame(thigh),
      {{"flexion", 0, -1, -30, 120}, {"adduction", 1, side, -45, 30}, {"rotation", 2, -side, -45, 45}},
      {alias + "UpLeg", small + "UpperLeg"});
  rest_from_axes(hip);
  build.by_sphere(hip, "femur" + end, "pelvis");
  build.add("shank" + end, "thigh" + end, "knee" + end, JointKind::hinge, point(at.knee), frame(shank),
            {{"flexion", 0, 1, -5, 135}, {"adduction", 1, side, 0, 0}, {"rotation", 2, -side, 0, 0}},
            {alias + "Leg", small + "LowerLeg"});
  build.add("foot" + end, "shank" + end, "ankle" + end, JointKind::universal, point(at.ankle), frame(at.foot),
            {{"dorsiflexion", 0, -1, -50, 20}, {"eversion", 1, -side, -35, 20}, {"rotation", 2, -side, 0, 0}},
            {alias + "Foot", small + "Foot"});
  build.add("toes" + end, "foot" + end, "toe_joint" + end, JointKind::hinge, point(at.ball), frame(at.foot),
            {{"extension", 0, -1, -40, 65}, {"adduction", 1, side, 0, 0}, {"rotation", 2, -side, 0, 0}},
            {alias + "ToeBase", small + "Toes"});
}

}  // namespace

Skeleton make_skeleton(const Landmarks& at, bool patient) {
  Builder build(patient);
  const Eigen::Matrix3d lps = Eigen::Matrix3d::Identity();
  const auto trunk = [&](const char* name, const char* parent, const char* joint, const Vec& center,
                         double bend, double lean, double turn, std::vector<std::string> aliases) {
    build
        .add(name, parent, joint, JointKind::ball, center, lps,
             {{"flexion", 0, 1, -0.5 * bend, bend},
              {"lateral_bending", 1, 1, -lean, lean},
              {"rotation", 2, 1, -turn, turn}},
             std::move(aliases))
        .limits_source = kSpineRanges;
  };
  Joint& root = build.add("pelvis", "", "pelvis", JointKind::free, at.root, lps,
                          {{"tilt", 0, 1, 0, 0}, {"obliquity", 1, 1, 0, 0}, {"rotation", 2, 1, 0, 0}},
                          {"Hips", "hips"});
  for (AngleAxis& angle : root.sequence) {
    angle.min = -std::numeric_limits<double>::infinity();
    angle.max = std::numeric_limits<double>::infinity();
  }
  root.limits_source.clear();
  trunk("lumbar", "pelvis", "lumbosacral", at.lumbar, 60, 25, 10, {"LowerBack"});
  trunk("thorax", "lumbar", "thoracolumbar", at.thorax, 40, 25, 35,
        {"Spine1", "Spine", "chest", "upperChest"});
  trunk("neck", "thorax", "cervicothoracic", at.neck, 40, 30, 45, {"Neck", "Neck1"});
  trunk("head", "neck", "atlantooccipital", at.head, 30, 15, 45, {"Head"});
  for (const bool left : {true, false}) {
    add_arm(build, at, left);
    add_leg(build, at, left);
  }
  return build.take();
}

}  // namespace ecorche::phantom
