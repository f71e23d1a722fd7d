// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/forward.hpp>

#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::kinematics {
namespace {

// A R(q) A' as a quaternion: the vector part turns with the frame and the scalar part stays, so that the
// identity stays the identity to the last bit.
Eigen::Quaterniond in_space(const Eigen::Matrix3d& axes, const Eigen::Quaterniond& q) {
  const Eigen::Vector3d v = axes * q.vec();
  return {q.w(), v.x(), v.y(), v.z()};
}

void align_sign(Eigen::Quaterniond& q, const Eigen::Quaterniond& other) {
  if (q.dot(other) < 0) q.coeffs() = -q.coeffs();
}

}  // namespace

void forward(const Rig& rig, const Pose& pose, std::span<RigidTransform> out) {
  const auto& segments = rig.skeleton.segments;
  if (pose.rotation.size() != segments.size() || pose.translation.size() != segments.size() ||
      out.size() != segments.size()) {
    throw Error(ErrorKind::internal, "forward kinematics",
                "a pose of " + std::to_string(pose.rotation.size()) + " rotations and " +
                    std::to_string(pose.translation.size()) + " translations for " +
                    std::to_string(segments.size()) + " joints",
                "make one of each for every joint");
  }
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const Joint& joint = segments[s].joint;
    RigidTransform local;
    local.q = in_space(joint.axes, pose.rotation[s].normalized());
    local.t = joint.center - local.q * joint.center;
    if (segments[s].parent < 0) {
      align_sign(local.q, Eigen::Quaterniond::Identity());
      local.t += pose.root_translation;
      out[s] = local;
      continue;
    }
    local.t += joint.axes * pose.translation[s];
    const RigidTransform& parent = out[static_cast<std::size_t>(segments[s].parent)];
    out[s] = parent * local;
    out[s].q.normalize();
    align_sign(out[s].q, parent.q);
  }
}

std::vector<RigidTransform> forward(const Rig& rig, const Pose& pose) {
  std::vector<RigidTransform> out(rig.skeleton.segments.size());
  forward(rig, pose, out);
  return out;
}

}  // namespace ecorche::kinematics
