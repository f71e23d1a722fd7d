// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/posed_rest.hpp"

#include <algorithm>

#include "core/kinematics/angles.hpp"
#include "core/kinematics/forward.hpp"

namespace ecorche::kinematics {
namespace {

constexpr double kRounding = 1e-9;  // radians

// An angle that rounding took out of its range goes back to its end; the body's own may lie where they like.
double within(const AngleAxis& angle, double value) {
  if (value < angle.min && value > angle.min - kRounding) return angle.min;
  if (value > angle.max && value < angle.max + kRounding) return angle.max;
  return std::abs(value) < kRounding ? 0 : value;
}

}  // namespace

Skeleton posed_rest(const Rig& rig, const Pose& pose) {
  const std::vector<RigidTransform> motion = forward(rig, pose);
  Skeleton posed = rig.skeleton;
  for (std::size_t s = 0; s < posed.segments.size(); ++s) {
    Joint& joint = posed.segments[s].joint;
    if (!joint.sequence.empty()) {
      const std::array<double, 3> angles = angles_from_rotation(joint, pose.rotation[s]);
      for (std::size_t a = 0; a < joint.sequence.size(); ++a)
        joint.sequence[a].rest = within(joint.sequence[a], angles[a]);
    }
    joint.rule = CenterRule::given;
    joint.center_bone.clear();
    joint.facing_bone.clear();
    joint.how.reset();
    joint.center = motion[s] * joint.center;
    joint.axes = motion[s].q.toRotationMatrix() * joint.axes;
  }
  return posed;
}

}  // namespace ecorche::kinematics
