// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rest_alignment.hpp"

#include <algorithm>
#include <numbers>

namespace ecorche::kinematics {
namespace {

constexpr double kLimb = 0.12;                           // of the skeleton's extent
constexpr double kAnatomy = 5 * std::numbers::pi / 180;  // angles that differ between any two bodies

// The only child of each segment, or -1.
std::vector<int> only_children(const Skeleton& skeleton) {
  std::vector<int> child(skeleton.segments.size(), -1), count(skeleton.segments.size(), 0);
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    const int parent = skeleton.segments[s].parent;
    if (parent < 0) continue;
    child[static_cast<std::size_t>(parent)] =
        ++count[static_cast<std::size_t>(parent)] == 1 ? static_cast<int>(s) : -1;
  }
  return child;
}

}  // namespace

Eigen::Vector3d zero_point(const Clip& clip, int joint) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (; joint >= 0; joint = clip.joints[static_cast<std::size_t>(joint)].parent)
    point += clip.joints[static_cast<std::size_t>(joint)].offset;
  return point;
}

std::vector<Eigen::Quaterniond> align_rest(const Rig& rig, const Clip& clip,
                                           const std::vector<int>& clip_joint) {
  const auto& segments = rig.skeleton.segments;
  Eigen::AlignedBox3d box;
  for (const Segment& segment : segments) box.extend(segment.joint.center);
  const double shortest = kLimb * box.diagonal().norm();
  const std::vector<int> child = only_children(rig.skeleton);

  std::vector<Eigen::Quaterniond> turn(segments.size(), Eigen::Quaterniond::Identity());
  for (std::size_t s = 0; s < segments.size(); ++s) {
    if (segments[s].parent >= 0) turn[s] = turn[static_cast<std::size_t>(segments[s].parent)];
    if (child[s] < 0) continue;
    const auto c = static_cast<std::size_t>(child[s]);
    if (clip_joint[s] < 0 || clip_joint[c] < 0) continue;
    const Eigen::Vector3d scanned = segments[c].joint.center - segments[s].joint.center;
    const Eigen::Vector3d drawn = zero_point(clip, clip_joint[c]) - zero_point(clip, clip_joint[s]);
    if (scanned.norm() < shortest || drawn.norm() == 0) continue;
    const auto more = Eigen::Quaterniond::FromTwoVectors(turn[s] * scanned, drawn);
    if (more.angularDistance(Eigen::Quaterniond::Identity()) >= kAnatomy)
      turn[s] = (more * turn[s]).normalized();
  }
  return turn;
}

}  // namespace ecorche::kinematics
