// SPDX-License-Identifier: Apache-2.0
// From tracked tools to a pose: each turns a joint, or pulls a point.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/kinematics/ik.hpp>
#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::app::igtl {

/// A tracked tool, and the segment that it moves.
struct Binding {
  std::string tool;
  std::size_t segment = 0;
};

/// What tools do.
struct Bindings {
  std::vector<Binding> joints;  ///< the tool's transform is the motion of the segment from the scan: its
                                ///< joint turns until the segment is turned so; the root also goes there
  std::vector<Binding> goals;   ///< the tool's origin is where a point of the segment shall be
  /// A tool counts from where it was first: however it is fixed to the body, nothing moves until it does.
  bool from_first = false;
};

/// The newest word of each tool, and the pose that they make. Joints are turned from the root outwards, then
/// goals are met by inverse kinematics, from the last pose.
class TrackedPose {
 public:
  /// `goals`: what stands before any tool is heard, pins among it. A goal's tool takes the first target of
  /// its segment, or adds one at the joint's centre, which counts once the tool is heard.
  TrackedPose(Rig rig, Pose start, kinematics::IkProblem goals, const Bindings& bindings);

  /// False where `tool` moves nothing. `at`: LPS mm.
  bool hear(std::string_view tool, const RigidTransform& at);
  /// Takes `pose`: what is pinned is pinned where it is then, nothing is looked at any more, and tools count
  /// once they are heard again, as if for the first time.
  void set(const Pose& pose);
  /// With all that was heard, within limits and couplings.
  const Pose& pose();

 private:
  struct Tool {
    Binding binding;
    std::optional<std::size_t> target = {};               // row of the goals; none: it turns the joint
    std::optional<RigidTransform> heard = {}, zero = {};  // zero: from what it was, to what it moves
  };
  RigidTransform motion(std::size_t segment) const;
  RigidTransform placed(const Tool& tool) const;
  void turn(std::size_t segment, const RigidTransform& to);
  void meet_goals();

  Rig rig_;
  Pose pose_;
  kinematics::IkProblem goals_;
  std::vector<bool> counts_;  // of goals_.targets: whether it is a goal yet
  std::vector<Tool> tools_;   // those of joints first, parents before children
  bool from_first_ = false, stale_ = true;
};

}  // namespace ecorche::app::igtl
