// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics: the pose in which points of the body are where they are wanted.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include <ecorche/values/pose.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::kinematics {

/// A point of a segment, and where it shall be. A pinned point is one whose goal is where it is.
struct IkTarget {
  std::size_t segment = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on the scanned body, LPS mm
  Eigen::Vector3d goal = Eigen::Vector3d::Zero();   ///< LPS mm
  double weight = 1;                                ///< over the others; positive
};

/// A direction of a segment that shall point at a place: the eyes of a head.
struct IkLook {
  std::size_t segment = 0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();        ///< from where, on the scanned body, LPS mm
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitY();  ///< on the scanned body, unit
  Eigen::Vector3d at = Eigen::Vector3d::Zero();           ///< LPS mm
  double weight = 1;
};

/// What is asked of a pose.
struct IkProblem {
  std::vector<IkTarget> targets;
  std::vector<IkLook> looks;
  bool move_root = false;     ///< whether the whole body may turn and go, as when feet are pinned
  double tolerance_mm = 0.1;  ///< when to stop: every point so near, every look as near at 200 mm
  int most_steps = 40;        ///< from each of the four starts
};

/// The pose that was found, and what it misses.
struct IkResult {
  Pose pose;                    ///< within limits and couplings
  std::vector<double> away_mm;  ///< of each target
  std::vector<double> off;      ///< radians, of each look
  int steps = 0;
  bool reached = false;  ///< all within the tolerance
};

/// Damped least squares (Wampler 1986; damping chosen as Levenberg and Marquardt do) over the anatomical
/// angles that the joints above the targets have, from `start`: what is needed moves, and little else. An
/// angle that would pass its limit goes up to it, and the others take what is left; coupled angles follow
/// theirs in the slopes too. Where that ends short of the goals (a straight limb, a corner of limits), the
/// way is tried again from angles nearer to the middle of their ranges; such a pose is taken where it
/// reaches, or comes at least a quarter nearer, lest a drag should jump. For a drag, start from the last
/// pose. Deterministic; well below a millisecond. bench/ik holds it against coordinate descent and FABRIK.
/// Throws Error{internal} for a segment that is not there, and what `constrain` throws.
IkResult solve_ik(const Rig& rig, const Pose& start, const IkProblem& problem);

}  // namespace ecorche::kinematics
