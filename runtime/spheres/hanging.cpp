// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/hanging.hpp"

#include <algorithm>

namespace ecorche::runtime {

Hanging hanging_of(const VolumetricSkeleton& skeleton, const Skeleton& rig) {
  Hanging out{skeleton.segment, {}};
  for (const Segment& segment : rig.segments) {
    const Eigen::Vector3d& at = segment.joint.center;
    out.joint.push_back({at.x(), at.y(), at.z()});
  }
  return out;
}

Skeleton with_joints(Skeleton rig, std::span<const Vec3> joint) {
  for (std::size_t s = 0; s < rig.segments.size(); ++s)
    rig.segments[s].joint.center = Eigen::Vector3d(joint[s].data());
  return rig;
}

std::vector<RigidTransform> about_joints(const Skeleton& rig, std::span<const Vec3> joint,
                                         std::span<const RigidTransform> motions) {
  std::vector<RigidTransform> out(motions.begin(), motions.end());
  const auto moved = [&](std::size_t s) {
    return rig.segments[s].joint.center != Eigen::Vector3d(joint[s].data());
  };
  std::vector<bool> follows(motions.size());
  for (std::size_t s = 0; s < motions.size(); ++s) {
    const std::int32_t parent = rig.segments[s].parent;
    const auto p = static_cast<std::size_t>(parent);
    follows[s] = moved(s) || (parent >= 0 && follows[p]);
    // To the last bit where nothing before it has moved.
    if (!follows[s]) continue;
    RigidTransform local = parent < 0 ? motions[s] : motions[p].inverse() * motions[s];
    const Eigen::Vector3d& was = rig.segments[s].joint.center;
    const Eigen::Vector3d is(joint[s].data()), shift = local * was - was;
    local.t = is + shift - local.q * is;
    out[s] = parent < 0 ? local : out[p] * local;
    out[s].q = motions[s].q;
  }
  return out;
}

}  // namespace ecorche::runtime
