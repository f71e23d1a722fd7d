// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/rig_clip.hpp"

namespace ecorche::kinematics {

Clip rig_clip(const Rig& rig, const std::string& name, double frame_seconds) {
  Clip clip;
  clip.name = name;
  clip.frame_seconds = frame_seconds;
  for (const Segment& segment : rig.skeleton.segments) {
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    if (segment.parent >= 0)
      from = rig.skeleton.segments[static_cast<std::size_t>(segment.parent)].joint.center;
    clip.joints.push_back({segment.name, segment.parent, segment.joint.center - from});
  }
  return clip;
}

bool add_frame(const Rig& rig, const Pose& pose, Clip& clip) {
  const auto& segments = rig.skeleton.segments;
  clip.root_position.push_back(segments[0].joint.center + pose.root_translation);
  bool whole = true;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const Eigen::Quaterniond q = pose.rotation[s].normalized();
    const Eigen::Vector3d v = segments[s].joint.axes * q.vec();  // A R(q) A'
    clip.rotation.emplace_back(q.w(), v.x(), v.y(), v.z());
    whole = whole && (s == 0 || pose.translation[s].isZero());
  }
  return whole;
}

}  // namespace ecorche::kinematics
