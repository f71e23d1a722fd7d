// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/angles.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <ecorche/values/error.hpp>
#include "core/kinematics/angle_limits.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Angles = std::array<double, 3>;

constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kReported = 1e-6;    // radians
constexpr double kGimbalLock = 1e-7;  // cosine of the middle angle; a rotation matrix carries 1e-16

bool three_axes(const Joint& joint) {
  const auto& s = joint.sequence;
  return s.size() == 3 && s[0].axis != s[1].axis && s[1].axis != s[2].axis && s[0].axis != s[2].axis &&
         std::all_of(s.begin(), s.end(), [](const AngleAxis& a) { return a.axis >= 0 && a.axis < 3; });
}

void need_three_axes(const Joint& joint) {
  if (three_axes(joint)) return;
  throw Error(ErrorKind::config, "joint " + joint.name, "its sequence is not three different axes",
              "write for example sequence: [{flexion: x}, {adduction: y}, {rotation: z}]");
}

Quaterniond turn(const AngleAxis& angle, double value) {
  return Quaterniond(Eigen::AngleAxisd(angle.sign * value, Eigen::Vector3d::Unit(angle.axis)));
}

Quaterniond intrinsic(const Joint& joint, const Angles& a) {
  return turn(joint.sequence[0], a[0]) * turn(joint.sequence[1], a[1]) * turn(joint.sequence[2], a[2]);
}

Angles rest_angles(const Joint& joint) {
  return {joint.sequence[0].rest, joint.sequence[1].rest, joint.sequence[2].rest};
}

// The value of `angle + k turns` nearest to the range, moved into it. An end without limit lies at `open`: if
// it went on for ever, any angle would be within the range a few turns further.
double into_range(const AngleAxis& range, double angle, double open) {
  const double low = std::min(std::isfinite(range.min) ? range.min : -open, range.rest);
  const double high = std::max(std::isfinite(range.max) ? range.max : open, range.rest);
  double best = angle, least = std::numeric_limits<double>::infinity();
  for (const double candidate : {angle, angle - kFullTurn, angle + kFullTurn}) {
    const double inside = std::clamp(candidate, low, high);
    if (std::abs(candidate - inside) >= least) continue;
    least = std::abs(candidate - inside);
    best = inside;
  }
  return best;
}

// Without a limit that says more, the middle angle stays within a quarter turn, as angles_from_rotation tells
// it.
Angles into_ranges(const Joint& joint, const Angles& angles) {
  const double pi = std::numbers::pi;
  return {into_range(joint.sequence[0], angles[0], pi), into_range(joint.sequence[1], angles[1], pi / 2),
          into_range(joint.sequence[2], angles[2], pi)};
}

bool limited(const Joint& joint) {
  return std::any_of(joint.sequence.begin(), joint.sequence.end(),
                     [](const AngleAxis& a) { return std::isfinite(a.min) || std::isfinite(a.max); });
}

// Full turns apart is the same angle.
bool same(const Angles& a, const Angles& b) {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(std::remainder(a[i] - b[i], kFullTurn)) > 1e-12) return false;
  }
  return true;
}

Quaterniond clamp_ball(const Joint& joint, const Quaterniond& rotation) {
  const Angles first = angles_from_rotation(joint, rotation);
  const Angles first_inside = into_ranges(joint, first);
  if (same(first, first_inside)) return rotation;
  const Angles second = other_triple(joint, first);
  const Angles second_inside = into_ranges(joint, second);
  if (same(second, second_inside)) return rotation;
  const Quaterniond one = rotation_from_angles(joint, first_inside);
  const Quaterniond two = rotation_from_angles(joint, second_inside);
  return one.angularDistance(rotation) <= two.angularDistance(rotation) ? one : two;
}

Quaterniond clamp_universal(const Joint& joint, const Quaterniond& rotation) {
  Angles angles = into_ranges(joint, angles_from_rotation(joint, rotation));
  angles[2] = joint.sequence[2].rest;
  const Quaterniond done = rotation_from_angles(joint, angles);
  return done.angularDistance(rotation) < 1e-12 ? rotation : done;
}

// With the other angles P = R(second, rest) R(third, rest) at rest, a flexion alone is P^-1 R(axis, t) P.
Quaterniond clamp_hinge(const Joint& joint, const Quaterniond& rotation) {
  const AngleAxis& hinge = joint.sequence[0];
  const Quaterniond others =
      turn(joint.sequence[1], joint.sequence[1].rest) * turn(joint.sequence[2], joint.sequence[2].rest);
  const Quaterniond about = others * rotation * others.conjugate();
  const double twist = 2 * std::atan2(about.vec()[hinge.axis], about.w());
  const double angle =
      into_range(hinge, hinge.rest + hinge.sign * std::remainder(twist, kFullTurn), std::numbers::pi);
  const Quaterniond done = others.conjugate() * turn(hinge, angle - hinge.rest) * others;
  return done.angularDistance(rotation) < 1e-12 ? rotation : done;
}

int find_angle(const Joint& joint, const std::string& name) {
  for (std::size_t i = 0; i < joint.sequence.size(); ++i) {
    if (joint.sequence[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

// How far the joint's slides bring it, mm along its axes at rest: after every angle is set.
Eigen::Vector3d slid(const Skeleton& skeleton, const Pose& pose, const Joint& joint) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (const Coupling& coupling : joint.coupled) {
    const int axis = coupling.slides(), lead = axis < 0 ? -1 : skeleton.find_joint(coupling.joint);
    if (lead < 0) continue;
    const Joint& leader = skeleton.segments[static_cast<std::size_t>(lead)].joint;
    const int leads = find_angle(leader, coupling.angle);
    if (leads < 0) continue;
    const auto a = static_cast<std::size_t>(leads);
    out[axis] +=
        coupling.ratio * (angles_within_limits(leader, pose.rotation[static_cast<std::size_t>(lead)])[a] -
                          leader.sequence[a].rest);
  }
  return out;
}

void report(std::vector<ClampedJoint>& clamped, std::size_t joint, double removed) {
  if (removed <= kReported) return;
  const auto found = std::find_if(clamped.begin(), clamped.end(),
                                  [&](const ClampedJoint& c) { return c.joint == static_cast<int>(joint); });
  if (found != clamped.end()) {
    found->removed = std::max(found->removed, removed);
  } else {
    clamped.push_back({static_cast<int>(joint), removed});
  }
}

void clamp_joint(const Skeleton& skeleton, Pose& pose, std::size_t row, std::vector<ClampedJoint>& clamped) {
  const Quaterniond asked = pose.rotation[row];
  pose.rotation[row] = clamp(skeleton.segments[row].joint, asked);
  report(clamped, row, asked.angularDistance(pose.rotation[row]));
}

}  // namespace

Quaterniond rotation_from_angles(const Joint& joint, const Angles& angles) {
  need_three_axes(joint);
  return intrinsic(joint, rest_angles(joint)).conjugate() * intrinsic(joint, angles);
}

// With (i, j, k) the axes of the sequence and e = +1 for an even permutation of (x, y, z), -1 for an odd one,
// M = Ri(a) Rj(b) Rk(c) has M(i,k) = e sin b, M(j,k) = -e sin a cos b, M(k,k) = cos a cos b,
// M(i,j) = -e cos b sin c, M(i,i) = cos b cos c.
Angles angles_from_rotation(const Joint& joint, const Quaterniond& rotation) {
  need_three_axes(joint);
  const Eigen::Matrix3d M = (intrinsic(joint, rest_angles(joint)) * rotation.normalized()).toRotationMatrix();
  const int i = joint.sequence[0].axis, j = joint.sequence[1].axis, k = joint.sequence[2].axis;
  const double e = (i + 1) % 3 == j ? 1 : -1;
  const double cos_b = std::hypot(M(i, i), M(i, j));
  const double b = std::atan2(e * M(i, k), cos_b);
  double a = 0, c = 0;
  if (cos_b > kGimbalLock) {
    a = std::atan2(-e * M(j, k), M(k, k));
    c = std::atan2(-e * M(i, j), M(i, i));
  } else {  // a and c turn about one line: leave the third at rest
    c = joint.sequence[2].sign * joint.sequence[2].rest;
    const auto about = [](int axis, double angle) {
      return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
    };
    const Eigen::Matrix3d first = M * about(k, -c) * about(j, -b);
    a = std::atan2(e * first(k, j), first(j, j));
  }
  return {a * joint.sequence[0].sign, b * joint.sequence[1].sign, c * joint.sequence[2].sign};
}

Quaterniond clamp(const Joint& joint, const Quaterniond& rotation) {
  switch (joint.kind) {
    case JointKind::fixed:
      return Quaterniond::Identity();
    case JointKind::hinge:
      need_three_axes(joint);
      return clamp_hinge(joint, rotation);
    case JointKind::universal:
      return clamp_universal(joint, rotation);
    case JointKind::ball:
    case JointKind::free:
      break;
  }
  return limited(joint) ? clamp_ball(joint, rotation) : rotation;
}

bool drives_angles(const Joint& joint) {
  return std::any_of(joint.coupled.begin(), joint.coupled.end(),
                     [](const Coupling& c) { return c.slides() < 0; });
}

Quaterniond follow(const Skeleton& skeleton, const Pose& pose, std::size_t row) {
  const Joint& joint = skeleton.segments[row].joint;
  Angles angles = angles_within_limits(joint, pose.rotation[row]);
  std::array<bool, 3> driven{false, false, false};
  for (const Coupling& coupling : joint.coupled) {
    if (coupling.slides() >= 0) continue;
    const int lead = skeleton.find_joint(coupling.joint);
    const int drives = find_angle(joint, coupling.drives);
    const int leads =
        lead < 0 ? -1 : find_angle(skeleton.segments[static_cast<std::size_t>(lead)].joint, coupling.angle);
    if (leads < 0 || drives < 0) {
      throw Error(ErrorKind::config, "joint " + joint.name,
                  "is coupled to angle '" + coupling.angle + "' of joint '" + coupling.joint +
                      "' through its angle '" + coupling.drives + "', one of which is absent",
                  "name joints and angles of this skeleton");
    }
    const Joint& leader = skeleton.segments[static_cast<std::size_t>(lead)].joint;
    const auto a = static_cast<std::size_t>(leads), b = static_cast<std::size_t>(drives);
    const double moved = angles_within_limits(leader, pose.rotation[static_cast<std::size_t>(lead)])[a] -
                         leader.sequence[a].rest;
    if (!driven[b]) angles[b] = joint.sequence[b].rest;
    driven[b] = true;
    angles[b] += coupling.ratio * moved;
  }
  return rotation_from_angles(joint, angles);
}

void constrain(const Skeleton& skeleton, Pose& pose, std::vector<ClampedJoint>& clamped) {
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    pose.rotation[s].normalize();
    if (skeleton.segments[s].parent < 0) continue;
    const Joint& joint = skeleton.segments[s].joint;
    clamp_joint(skeleton, pose, s, clamped);
    if (joint.kind != JointKind::free) pose.translation[s].setZero();
  }
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    if (skeleton.segments[s].parent < 0 || skeleton.segments[s].joint.coupled.empty()) continue;
    if (!drives_angles(skeleton.segments[s].joint)) continue;
    pose.rotation[s] = follow(skeleton, pose, s);
    clamp_joint(skeleton, pose, s, clamped);
  }
  slide(skeleton, pose);
}

void slide(const Skeleton& skeleton, Pose& pose) {
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    const Joint& joint = skeleton.segments[s].joint;
    if (skeleton.segments[s].parent >= 0 && joint.kind != JointKind::free && !joint.coupled.empty())
      pose.translation[s] = slid(skeleton, pose, joint);
  }
}

}  // namespace ecorche::kinematics
