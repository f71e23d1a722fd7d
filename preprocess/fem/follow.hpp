// SPDX-License-Identifier: Apache-2.0
// Continuation: from rest to a pose in steps small enough that no tet is turned inside out on the way.
#pragma once

#include <functional>

#include "preprocess/fem/newton.hpp"

namespace ecorche::fem {

struct FollowOptions {
  NewtonOptions last;             ///< of the pose itself
  double between_mm = 0.1;        ///< tolerance of the poses on the way
  double first_step = 0.25;       ///< of the way
  int most_iterations = 150;      ///< of Newton on the whole way
  double folds_below = 1.0 / 20;  ///< so small a step may turn a tet inside out: nothing else is left
  double least_step = 1.0 / 256;  ///< smaller ones give up
};

struct FollowResult {
  double reached = 0;  ///< of the way, 0 to 1
  int steps = 0, refused = 0;
  NewtonResult newton;  ///< of the last pose; iterations, factors and seconds of all
};

/// `held_at(t, x)` writes the places of held nodes at t of the way into their rows. `x`: at rest, all at t =
/// 0; then as far as it came. A step first moves the free nodes by the linear answer to the held ones' move;
/// where Newton does not converge from there, or a tet that was not is inside out in
/// the end, the step is halved; folds that smaller steps do not undo are there to be counted.
FollowResult follow(const Assembly& assembly, const Material& material, StepSolver& steps,
                    const std::function<void(double t, Points& x)>& held_at, const FollowOptions& options,
                    Points& x, const Context& context);

}  // namespace ecorche::fem
