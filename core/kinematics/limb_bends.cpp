// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/limb_bends.hpp"

#include <cmath>
#include <numbers>

#include <ecorche/kinematics/angles.hpp>
#include "core/kinematics/rest_alignment.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kLeastBend = 0.1;      // sine, in the mean
constexpr double kBent = 10 * kDegree;  // what is straighter has no plane
constexpr double kOneAxis = 0.9;        // of the summed weights
constexpr double kMostFlexed = 175 * kDegree;

bool is_hinge(const Segment& segment) {
  return segment.parent >= 0 && segment.joint.kind == JointKind::hinge && segment.joint.sequence.size() == 3;
}

}  // namespace

std::vector<int> only_child(const Skeleton& skeleton) {
  std::vector<int> out(skeleton.segments.size(), -1), count(skeleton.segments.size(), 0);
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    const int parent = skeleton.segments[s].parent;
    if (parent < 0) continue;
    const auto p = static_cast<std::size_t>(parent);
    out[p] = ++count[p] == 1 ? static_cast<int>(s) : -1;
  }
  return out;
}

BendFinder::BendFinder(const Rig& rig, const std::vector<int>& clip_joint)
    : segments_(rig.skeleton.segments.size()) {
  const std::vector<int> child = only_child(rig.skeleton);
  for (std::size_t s = 0; s < segments_; ++s) {
    const Segment& segment = rig.skeleton.segments[s];
    if (!is_hinge(segment) || child[s] < 0) continue;
    const int above = clip_joint[static_cast<std::size_t>(segment.parent)], below = clip_joint[s],
              end = clip_joint[static_cast<std::size_t>(child[s])];
    if (above < 0 || below < 0 || end < 0 || child[static_cast<std::size_t>(segment.parent)] < 0) continue;
    Hinge hinge;
    hinge.above = static_cast<std::size_t>(above);
    hinge.below = static_cast<std::size_t>(below);
    hinge.end = static_cast<std::size_t>(end);
    hinge.segment = s;
    hinges_.push_back(hinge);
  }
}

void BendFinder::add(const ClipPlaces& places) {
  ++frames_;
  for (Hinge& hinge : hinges_) {
    const Vector3d one = places.point[hinge.below] - places.point[hinge.above],
                   two = places.point[hinge.end] - places.point[hinge.below];
    const double length = one.norm() * two.norm();
    const double angle = std::atan2(one.cross(two).norm(), one.dot(two));
    if (!(length > 0) || angle < kBent) continue;
    const Vector3d normal = one.cross(two) / length;
    hinge.sum_above += places.turn[hinge.above].conjugate() * normal;
    hinge.sum_below += places.turn[hinge.below].conjugate() * normal;
    hinge.weight += normal.norm();
    hinge.angles.push_back(angle);
  }
}

std::vector<LimbBend> BendFinder::bends() const {
  std::vector<LimbBend> out(segments_);
  for (const Hinge& hinge : hinges_) {
    const double least = kOneAxis * hinge.weight;
    if (hinge.weight < kLeastBend * static_cast<double>(frames_) || hinge.sum_above.norm() < least ||
        hinge.sum_below.norm() < least)
      continue;
    out[hinge.segment] = {true, hinge.sum_above.normalized(), hinge.sum_below.normalized(), hinge.angles};
  }
  return out;
}

LimbBend bend_of(const Rig& rig, std::size_t segment, const std::vector<double>& angles) {
  const Segment& here = rig.skeleton.segments[segment];
  const std::vector<int> child = only_child(rig.skeleton);
  if (!is_hinge(here) || child[segment] < 0) return {};
  const Joint& joint = here.joint;
  const Vector3d one =
      joint.center - rig.skeleton.segments[static_cast<std::size_t>(here.parent)].joint.center;
  const Vector3d two =
      rig.skeleton.segments[static_cast<std::size_t>(child[segment])].joint.center - joint.center;
  const Quaterniond frame(joint.axes);
  const auto turn = [&](double flexion) {
    const Quaterniond local =
        rotation_from_angles(joint, {flexion, joint.sequence[1].rest, joint.sequence[2].rest});
    return Quaterniond(frame * local * frame.conjugate());
  };
  // Bent forwards, or beyond straight.
  const Vector3d forwards = one.cross(turn(0.5 * std::numbers::pi) * two);
  const auto bent = [&](double flexion) {
    const Vector3d at = turn(flexion) * two, normal = one.cross(at);
    const double angle = std::atan2(normal.norm(), one.dot(at));
    return normal.dot(forwards) < 0 ? -angle : angle;
  };
  LimbBend out;
  for (const double angle : angles) {
    double low = -0.5 * std::numbers::pi, high = kMostFlexed;
    for (int half = 0; half < 50; ++half) {
      const double middle = 0.5 * (low + high);
      (bent(middle) < angle ? low : high) = middle;
    }
    const Quaterniond q = turn(low);
    const Vector3d normal = one.cross(q * two);
    out.above += normal;
    out.below += q.conjugate() * normal;
  }
  out.known = out.above.norm() > 1e-6 * one.norm() * two.norm();
  if (!out.known) return {};
  out.above.normalize();
  out.below.normalize();
  return out;
}

}  // namespace ecorche::kinematics
