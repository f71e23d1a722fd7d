// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/posed_rest.hpp"

#include <algorithm>
#include <cmath>

#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/angle_limits.hpp"

namespace ecorche::kinematics {
namespace {

constexpr double kRounding = 1e-9;  // radians

// An angle that rounding took out of its range goes back to its end; the body's own may lie where they like.
double within(const AngleAxis& angle, double value) {
  if (value < angle.min && value > angle.min - kRounding) return angle.min;
  if (value > angle.max && value < angle.max + kRounding) return angle.max;
  return std::abs(value) < kRounding ? 0 : value;
}

// A joint slides along its axes at rest, which its parent carries; `turned` brings these to the posed
// joint's. So one slide becomes up to three.
std::vector<Coupling> turned_slides(const std::vector<Coupling>& coupled, const Eigen::Matrix3d& turned) {
  constexpr double kNothing = 1e-12;
  std::vector<Coupling> out;
  for (const Coupling& coupling : coupled) {
    const int axis = coupling.slides();
    if (axis < 0) {
      out.push_back(coupling);
      continue;
    }
    for (int a = 0; a < 3; ++a) {
      if (std::abs(turned(a, axis)) < kNothing) continue;
      out.push_back(coupling);
      out.back().drives[0] = static_cast<char>('x' + a);
      out.back().ratio *= turned(a, axis);
    }
  }
  return out;
}

}  // namespace

Skeleton posed_rest(const Rig& rig, const Pose& pose) {
  const std::vector<RigidTransform> motion = forward(rig, pose);
  Skeleton posed = rig.skeleton;
  for (std::size_t s = 0; s < posed.segments.size(); ++s) {
    Joint& joint = posed.segments[s].joint;
    if (!joint.sequence.empty()) {
      const std::array<double, 3> angles = angles_within_limits(joint, pose.rotation[s]);
      for (std::size_t a = 0; a < joint.sequence.size(); ++a)
        joint.sequence[a].rest = within(joint.sequence[a], angles[a]);
    }
    joint.rule = CenterRule::given;
    joint.center_bone.clear();
    joint.facing_bone.clear();
    joint.how.reset();
    joint.center = motion[s] * joint.center;
    const Eigen::Matrix3d axes = motion[s].q.toRotationMatrix() * joint.axes;
    if (const int parent = posed.segments[s].parent; parent >= 0) {
      joint.coupled = turned_slides(
          joint.coupled, axes.transpose() * motion[static_cast<std::size_t>(parent)].q * joint.axes);
    }
    joint.axes = axes;
  }
  return posed;
}

}  // namespace ecorche::kinematics
