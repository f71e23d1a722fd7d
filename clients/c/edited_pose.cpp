// SPDX-License-Identifier: Apache-2.0
#include "clients/c/edited_pose.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/named_angles.hpp>
#include "clients/c/guard.hpp"
#include "core/kinematics/angle_limits.hpp"

namespace ecorche::c {
namespace {

ecorche_code is_null() {
  return fail(ECORCHE_INVALID_ARGUMENT, "joint, angle, numbers: is null");
}

ecorche_code not_finite() {
  return fail(ECORCHE_INVALID_ARGUMENT,
              "pose: holds a number that is not finite (give radians and millimetres)");
}

ecorche_code no_angle(std::size_t count) {
  return fail(ECORCHE_INVALID_ARGUMENT, "angle: the model has " + std::to_string(count) + " of them");
}

ecorche_code no_segment(std::size_t count) {
  return fail(ECORCHE_INVALID_ARGUMENT, "segment: the model has " + std::to_string(count) + " of them");
}

}  // namespace

std::vector<AngleRow> angle_rows(const Skeleton& skeleton) {
  std::vector<AngleRow> out;
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    const std::size_t angles = skeleton.segments[s].joint.sequence.size();
    for (std::size_t a = 0; a < angles && a < 3; ++a) out.push_back({s, a});
  }
  return out;
}

ecorche_code fill_segment(const Rig& rig, std::uint32_t row, ecorche_segment_info* out) {
  const std::vector<Segment>& all = rig.skeleton.segments;
  if (row >= all.size()) return no_segment(all.size());
  const Segment& s = all[row];
  ecorche_segment_info info = ECORCHE_SEGMENT_INFO_INIT;
  info.name = s.name.c_str();
  info.joint = s.joint.name.c_str();
  info.parent = s.parent;
  std::copy_n(s.joint.center.data(), 3, info.centre);
  std::copy_n(s.joint.axes.data(), 9, info.axes);  // column by column: axis by axis
  info.confidence = row < rig.fits.size() ? rig.fits[row].confidence : 1;
  return fill(out, info);
}

ecorche_code fill_angle(const Skeleton& skeleton, const std::vector<AngleRow>& rows, std::uint32_t row,
                        ecorche_angle_info* out) {
  if (row >= rows.size()) return no_angle(rows.size());
  const Joint& joint = skeleton.segments[rows[row].segment].joint;
  const AngleAxis& axis = joint.sequence[rows[row].place];
  ecorche_angle_info info = ECORCHE_ANGLE_INFO_INIT;
  info.joint = joint.name.c_str();
  info.name = axis.name.c_str();
  info.segment = static_cast<std::uint32_t>(rows[row].segment);
  info.rest = axis.rest;
  info.min = axis.min;
  info.max = axis.max;
  return fill(out, info);
}

std::int32_t find_segment(const Skeleton& skeleton, const char* name) {
  if (name == nullptr) return -1;
  const int segment = skeleton.find_segment(name);
  return segment >= 0 ? segment : skeleton.find_joint(name);
}

EditedPose::EditedPose(const Skeleton& skeleton) : skeleton_(&skeleton) {
  set(Pose::rest(skeleton.segments.size()));
}

void EditedPose::set(Pose pose) {
  pose_ = std::move(pose);
  angles_.resize(pose_.rotation.size());
  for (std::size_t s = 0; s < angles_.size(); ++s) read_angles(s);
}

ecorche_code EditedPose::set_angle(const char* joint, const char* angle, double radians) {
  if (joint == nullptr || angle == nullptr) return is_null();
  if (!std::isfinite(radians)) return not_finite();
  const auto found = kinematics::find_named_angle(*skeleton_, joint, angle);
  if (!found) {
    return fail(ECORCHE_NOT_FOUND,
                std::string(joint) + "." + angle + ": the model has no such angle (ecorche info lists them)");
  }
  turn(found->row, found->angle, found->sign * radians);
  return ECORCHE_OK;
}

ecorche_code EditedPose::set_angle_at(const std::vector<AngleRow>& rows, std::uint32_t row, double radians) {
  if (!std::isfinite(radians)) return not_finite();
  if (row >= rows.size()) return no_angle(rows.size());
  turn(rows[row].segment, rows[row].place, radians);
  return ECORCHE_OK;
}

ecorche_code EditedPose::angle_at(const std::vector<AngleRow>& rows, std::uint32_t row,
                                  double* radians) const {
  if (radians == nullptr) return is_null();
  if (row >= rows.size()) return no_angle(rows.size());
  *radians = angles_[rows[row].segment][rows[row].place];
  return ECORCHE_OK;
}

ecorche_code EditedPose::set_rotation(std::uint32_t segment, const double xyzw[4]) {
  if (xyzw == nullptr) return is_null();
  if (segment >= angles_.size()) return no_segment(angles_.size());
  Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  const double length = q.coeffs().stableNorm();
  if (!(std::abs(length - 1) <= 1e-2)) {
    return fail(ECORCHE_INVALID_ARGUMENT,
                "xyzw: has the length " + std::to_string(length) + " (give a unit quaternion)");
  }
  q.coeffs() /= length;
  pose_.rotation[segment] = q;
  read_angles(segment);
  return ECORCHE_OK;
}

ecorche_code EditedPose::rotation(std::uint32_t segment, double xyzw[4]) const {
  if (xyzw == nullptr) return is_null();
  if (segment >= angles_.size()) return no_segment(angles_.size());
  std::copy_n(pose_.rotation[segment].coeffs().data(), 4, xyzw);
  return ECORCHE_OK;
}

ecorche_code EditedPose::set_root(const double translation[3]) {
  if (translation == nullptr) return is_null();
  const Eigen::Vector3d to(translation[0], translation[1], translation[2]);
  if (!to.allFinite()) return not_finite();
  pose_.root_translation = to;
  return ECORCHE_OK;
}

void EditedPose::read_angles(std::size_t segment) {
  const Joint& joint = skeleton_->segments[segment].joint;
  if (joint.sequence.size() == 3)
    angles_[segment] = kinematics::angles_within_limits(joint, pose_.rotation[segment]);
}

void EditedPose::turn(std::size_t segment, std::size_t place, double radians) {
  angles_[segment][place] = radians;
  pose_.rotation[segment] =
      kinematics::rotation_from_angles(skeleton_->segments[segment].joint, angles_[segment]);
}

}  // namespace ecorche::c
