// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/body_frame.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/linear/decompositions.hpp"
#include "preprocess/rig/parted_bones.hpp"
#include "preprocess/rig/pelvis_frame.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Middles of the bones' surfaces beside that of the pelvis, mm, in a body that stands straight: the means of
// BodyParts3D and ICRP's woman, which are 1 and 2 degrees off them.
struct Middle {
  std::string_view segment;
  Vector3d at;
};
const std::array<Middle, 4>& upright() {
  static const std::array<Middle, 4> middles{{{"pelvis", {0, 0, 0}},
                                              {"thorax", {0, 4, 345}},
                                              {"girdle_left", {100, 27, 453}},
                                              {"girdle_right", {-100, 27, 453}}}};
  return middles;
}

constexpr double kUnlike = 0.15;  // of the root of the mean square of all from their middle
constexpr double kLeastMm = 1;    // four that lie in one place show nothing
constexpr double kAsMuch = 0.75;  // of the other girdle's surface: less lacks a bone
// Of the thorax's surface: a girdle has 0.10 in BodyParts3D, 0.13 in ICRP's woman, a clavicle alone 0.02.
constexpr double kGirdle = 0.05;

bool says_the_body(const Skeleton& skeleton) {
  return skeleton.name == "human" || is_parted(skeleton);
}

// By area: a mesh that is finer on one side does not draw it there.
struct Measured {
  Vector3d middle = Vector3d::Zero();
  double area = 0;  // twice that
};
std::optional<Measured> measured(const Case& patient, std::string_view segment) {
  Vector3d sum = Vector3d::Zero();
  double area = 0;
  for (const CaseBone& bone : patient.bones) {
    if (bone.segment != segment) continue;
    const SurfaceMesh& mesh = bone.surface;
    for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
      const Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)), c = mesh.V.row(mesh.F(f, 2));
      const double twice = (b - a).cross(c - a).norm();
      sum += twice * (a + b + c) / 3;
      area += twice;
    }
  }
  if (!(area > 0)) return std::nullopt;
  return Measured{sum / area, area};
}

// A girdle without its scapula has another middle than the one it is laid onto, and would turn the body.
bool lacks_bones(std::size_t m, const std::vector<Measured>& parts) {
  constexpr std::size_t thorax = 1, left = 2, right = 3;
  if (m != left && m != right) return false;
  const double other = parts[m == left ? right : left].area;
  return parts[m].area < kAsMuch * other || parts[m].area < kGirdle * parts[thorax].area;
}

// The best turn of the upright middles onto those of this body, of the `rows` that count.
template <std::size_t count>
Matrix3d laid(const std::array<std::size_t, count>& rows, const std::vector<Measured>& parts) {
  Eigen::Matrix<double, 3, static_cast<int>(count)> straight, here;
  for (std::size_t m = 0; m < count; ++m) {
    straight.col(static_cast<Eigen::Index>(m)) = upright()[rows[m]].at;
    here.col(static_cast<Eigen::Index>(m)) = parts[rows[m]].middle;
  }
  straight.colwise() -= straight.rowwise().mean().eval();
  here.colwise() -= here.rowwise().mean().eval();
  const double size = here.norm();
  if (!(size > kLeastMm)) return Matrix3d::Identity();
  straight *= size / straight.norm();
  const Matrix3d frame = linear::nearest_turn(here * straight.transpose());
  return (here - frame * straight).norm() > kUnlike * size ? Matrix3d(Matrix3d::Identity()) : frame;
}

void turn_points(PointSource& source, const Matrix3d& turn) {
  source.point = turn * source.point;
  for (PointSource& part : source.parts) turn_points(part, turn);
}

void turn_points(DirectionSource& source, const Matrix3d& turn) {
  turn_points(source.from, turn);
  turn_points(source.to, turn);
  for (DirectionSource& choice : source.choices) turn_points(choice, turn);
}

void turn_joint(Joint& joint, const Matrix3d& turn) {
  joint.center = turn * joint.center;
  // Left, back and up of a joint with a rule that says no axes are the body's.
  const bool of_body = joint.how && (!joint.how->axes.empty() || joint.axes.isIdentity(0));
  if (!of_body) joint.axes = turn * joint.axes;
  if (!joint.how) return;
  auto how = std::make_shared<JointRule>(*joint.how);
  turn_points(how->center, turn);
  for (auto& [axis, source] : how->axes) turn_points(source, turn);
  joint.how = how;
}

}  // namespace

Matrix3d body_frame(const Case& patient) {
  if (patient.generic || !says_the_body(patient.skeleton)) return Matrix3d::Identity();
  // A region that stands in the scan's coordinates was marked by somebody who says its axes, too.
  for (const Region& region : patient.regions) {
    if (!region.boxes.empty() && !region.of_bones && region.near.empty()) return Matrix3d::Identity();
  }
  if (!measured(patient, "thorax")) return pelvis_frame(patient).value_or(Matrix3d::Identity());
  std::vector<Measured> parts;
  for (const Middle& middle : upright()) {
    const std::optional<Measured> part = measured(patient, middle.segment);
    if (!part) return Matrix3d::Identity();
    parts.push_back(*part);
  }
  if (!lacks_bones(2, parts) && !lacks_bones(3, parts)) return laid<4>({0, 1, 2, 3}, parts);
  if (!lacks_bones(2, parts)) return laid<3>({0, 1, 2}, parts);
  if (!lacks_bones(3, parts)) return laid<3>({0, 1, 3}, parts);
  return Matrix3d::Identity();  // two leave it free to turn
}

Case turned(const Case& patient, const Matrix3d& turn) {
  Case out;
  out.name = patient.name;
  out.generic = patient.generic;
  out.skeleton = patient.skeleton;
  for (Segment& segment : out.skeleton.segments) turn_joint(segment.joint, turn);
  out.regions = patient.regions;
  for (Region& region : out.regions) region.points = region.points * turn.transpose();
  for (const CaseBone& bone : patient.bones) {
    out.bones.push_back({bone.name, bone.segment, bone.surface});
    out.bones.back().surface.V = bone.surface.V * turn.transpose();
  }
  return out;
}

}  // namespace ecorche::rig
