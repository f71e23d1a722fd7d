// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/tracked_pose.hpp"

#include <algorithm>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>

namespace ecorche::app::igtl {

TrackedPose::TrackedPose(Rig rig, Pose start, kinematics::IkProblem goals, const Bindings& bindings)
    : rig_(std::move(rig)),
      pose_(std::move(start)),
      goals_(std::move(goals)),
      counts_(goals_.targets.size(), true),
      from_first_(bindings.from_first) {
  for (const Binding& binding : bindings.joints) tools_.push_back({.binding = binding});
  std::stable_sort(tools_.begin(), tools_.end(),
                   [](const Tool& a, const Tool& b) { return a.binding.segment < b.binding.segment; });
  for (const Binding& binding : bindings.goals) {
    const auto target =
        std::find_if(goals_.targets.begin(), goals_.targets.end(),
                     [&binding](const kinematics::IkTarget& one) { return one.segment == binding.segment; });
    const auto row = static_cast<std::size_t>(target - goals_.targets.begin());
    if (target == goals_.targets.end()) {
      const Eigen::Vector3d& center = rig_.skeleton.segments[binding.segment].joint.center;
      goals_.targets.push_back({binding.segment, center, center, 1});
      counts_.push_back(false);
    }
    tools_.push_back({.binding = binding, .target = row});
  }
}

RigidTransform TrackedPose::motion(std::size_t segment) const {
  return kinematics::forward(rig_, pose_)[segment];
}

bool TrackedPose::hear(std::string_view tool, const RigidTransform& at) {
  bool moves = false;
  for (Tool& one : tools_) {
    if (one.binding.tool != tool) continue;
    if (from_first_ && !one.zero) {
      pose();  // what was heard of others comes first
      RigidTransform now = motion(one.binding.segment);
      if (one.target) now.t = now * goals_.targets[*one.target].point;
      one.zero = at.inverse() * now;
    }
    one.heard = at;
    stale_ = moves = true;
  }
  return moves;
}

void TrackedPose::set(const Pose& pose) {
  pose_ = pose;
  std::vector<ClampedJoint> clamped;
  kinematics::constrain(rig_.skeleton, pose_, clamped);
  goals_.looks.clear();
  for (kinematics::IkTarget& target : goals_.targets) target.goal = motion(target.segment) * target.point;
  for (Tool& tool : tools_) {
    tool.heard.reset();
    tool.zero.reset();
    if (tool.target) counts_[*tool.target] = false;
  }
  stale_ = false;
}

RigidTransform TrackedPose::placed(const Tool& tool) const {
  return tool.zero ? *tool.heard * *tool.zero : *tool.heard;
}

// As kinematics::forward has it: global = parent * (x -> A R(q) A' (x - c) + c + A t), the root's t in LPS.
void TrackedPose::turn(std::size_t segment, const RigidTransform& to) {
  const Segment& one = rig_.skeleton.segments[segment];
  const RigidTransform parent =
      one.parent < 0 ? RigidTransform{} : motion(static_cast<std::size_t>(one.parent));
  const RigidTransform local = parent.inverse() * to;
  const Eigen::Quaterniond axes(one.joint.axes);
  pose_.rotation[segment] = (axes.conjugate() * local.q * axes).normalized();
  const Eigen::Vector3d gone = local * one.joint.center - one.joint.center;
  if (one.parent < 0) {
    pose_.root_translation = gone;
  } else if (one.joint.kind == JointKind::free) {
    pose_.translation[segment] = one.joint.axes.transpose() * gone;
  }
}

void TrackedPose::meet_goals() {
  kinematics::IkProblem asked = goals_;
  asked.targets.clear();
  for (std::size_t row = 0; row < goals_.targets.size(); ++row) {
    if (counts_[row]) asked.targets.push_back(goals_.targets[row]);
  }
  if (asked.targets.empty() && asked.looks.empty()) return;
  pose_ = kinematics::solve_ik(rig_, pose_, asked).pose;
}

const Pose& TrackedPose::pose() {
  if (!stale_) return pose_;
  std::vector<ClampedJoint> clamped;
  for (const Tool& tool : tools_) {
    if (!tool.heard) continue;
    if (tool.target) {
      goals_.targets[*tool.target].goal = placed(tool).t;
      counts_[*tool.target] = true;
    } else {
      turn(tool.binding.segment, placed(tool));
      kinematics::constrain(rig_.skeleton, pose_, clamped);  // the next one hangs on what was possible
    }
  }
  meet_goals();
  stale_ = false;
  return pose_;
}

}  // namespace ecorche::app::igtl
