// SPDX-License-Identifier: Apache-2.0
// The other two well-tried methods, with the same limits and couplings: what bench_ik holds ours against.
#pragma once

#include <ecorche/kinematics/ik.hpp>

namespace ecorche::bench {

/// Cyclic coordinate descent (Wang and Chen, A combined optimization method for solving the inverse
/// kinematics problem, 1991): joint by joint from the target's to the root's child, each turned so that the
/// point comes nearest to its goal, then constrained. Several targets: a pass for each. Targets alone, the
/// root stands.
kinematics::IkResult coordinate_descent(const Rig& rig, const Pose& start,
                                        const kinematics::IkProblem& problem);

/// FABRIK (Aristidou and Lasenby, FABRIK: a fast, iterative solver for the inverse kinematics problem, 2011):
/// joint centres are pulled towards the goals, from the ends inwards, at their distances, the mean taken
/// where chains meet; then from the root outwards each segment turns the least way onto what was pulled (all
/// its points at once where it has several), within limits and couplings. Targets
/// alone, the root stands.
kinematics::IkResult fabrik(const Rig& rig, const Pose& start, const kinematics::IkProblem& problem);

}  // namespace ecorche::bench
