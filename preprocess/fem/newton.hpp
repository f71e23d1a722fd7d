// SPDX-License-Identifier: Apache-2.0
// Projected Newton: from a start to the nearest place where all forces on free nodes vanish.
#pragma once

#include <cstddef>
#include <functional>

#include <ecorche/values/context.hpp>
#include "core/solve/spd_solver.hpp"
#include "preprocess/fem/assembly.hpp"

namespace ecorche::fem {

struct NewtonOptions {
  /// Brings the free nodes near to balance by cheaper steps, and returns how many; null: Newton begins where
  /// it is put. What it finds is taken where energy falls and no more tets are inside out.
  std::function<int(Points& x, const Context& context)> settle;
  double tolerance_mm = 1e-4;  ///< converged when no free node would move farther in a whole step
  int most_iterations = 60;
  /// Filtered Hessians until a step moves no node farther than this, then the true ones while they are
  /// positive definite: far off they point nowhere, near the end they converge quadratically.
  double exact_below_mm = 2;
  double far_tolerance = 2e-2;     ///< of the linear systems while Hessians are filtered, relative residual
  double linear_tolerance = 1e-3;  ///< of those of true Hessians
};

/// Where the time went, s.
struct Seconds {
  double settle = 0, assemble = 0, factor = 0, solve = 0, energy = 0;
};

struct NewtonResult {
  bool converged = false;
  int iterations = 0, factors = 0;
  int settling_steps = 0;  ///< of NewtonOptions::settle
  double step_mm = 0;      ///< largest move of a node that the last whole step asked for
  double residual = 0;     ///< largest force left on a free node, over the largest that holds a node
  Total total;
  Seconds seconds;
};

/// The linear systems of one Assembly: conjugate gradients on the Hessian of now, preconditioned by the
/// factor of an earlier one; factored again (its shape is kept) where that takes too many rounds.
class StepSolver {
 public:
  StepSolver(const Assembly& assembly, solve::SpdSolver& solver) : assembly_(assembly), solver_(solver) {}

  /// H d = -g, in rows of the free nodes. `exact` is set to false, and H assembled filtered, where the true
  /// Hessian is not positive definite. `g` comes out as of `x`, and of `increment` (Assembly::derivatives).
  Points step(const Material& material, const Points& x, const Points* increment, bool& exact,
              double tolerance, Points& g, NewtonResult& told, const Context& context);

 private:
  bool conjugate(const solve::SparseMatrix& H, const Eigen::VectorXd& b, double tolerance, int rounds,
                 Eigen::VectorXd& d, bool& definite, NewtonResult& told, const Context& context) const;
  void factor(const solve::SparseMatrix& H, NewtonResult& told, const Context& context);

  const Assembly& assembly_;
  solve::SpdSolver& solver_;
  bool factored_ = false;
};

/// Moves the free nodes of `x` (held ones stand where they are wanted). A step is halved until the energy
/// falls by a part of what was foreseen (Armijo's 1e-4) and, where no tet is inverted, none becomes so; where
/// that would leave less than an eighth of the step, or in a body with folds, the energy alone decides: a
/// material that has a price for inversion finds the way out of it, and sooner where other tets may give way
/// meanwhile. Whoever calls looks at what is inverted in the end.
NewtonResult minimise(const Assembly& assembly, const Material& material, StepSolver& steps,
                      const NewtonOptions& options, Points& x, const Context& context);

/// x moved by d, rows of the free nodes, so many times.
Points moved(const Mesh& mesh, const Points& x, const Points& d, double times);

/// Whether `now` has a tet inside out that `before` had not.
bool inverts(const Total& before, const Total& now);

}  // namespace ecorche::fem
