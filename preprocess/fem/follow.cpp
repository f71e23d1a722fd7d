// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/follow.hpp"

#include <algorithm>
#include <limits>

namespace ecorche::fem {
namespace {

void add(NewtonResult& sum, NewtonResult one) {
  one.iterations += sum.iterations;
  one.factors += sum.factors;
  one.settling_steps += sum.settling_steps;
  one.seconds.settle += sum.seconds.settle;
  one.seconds.assemble += sum.seconds.assemble;
  one.seconds.factor += sum.seconds.factor;
  one.seconds.solve += sum.seconds.solve;
  one.seconds.energy += sum.seconds.energy;
  sum = std::move(one);
}

}  // namespace

FollowResult follow(const Assembly& assembly, const Material& material, StepSolver& steps,
                    const std::function<void(double t, Points& x)>& held_at, const FollowOptions& options,
                    Points& x, const Context& context) {
  FollowResult out;
  out.newton.total = assembly.total(material, x);
  double step = options.first_step;
  double folds_at = std::numeric_limits<double>::infinity();  // where a step last ended in new ones
  while (out.reached < 1 && step >= options.least_step && out.newton.iterations < options.most_iterations) {
    context.check_stop();
    const double t = std::min(1.0, out.reached + step);
    Points goal = x;
    held_at(t, goal);
    const Points increment = goal - x;
    NewtonResult told;
    Points g;
    bool exact = false;
    const Points d =
        steps.step(material, x, &increment, exact, options.last.linear_tolerance, g, told, context);
    Points next = moved(assembly.mesh(), goal, d, 1);
    NewtonOptions newton = options.last;
    if (t < 1) {  // near already: what strides farther may leave the way for another balance
      newton.tolerance_mm = std::max(newton.tolerance_mm, options.between_mm);
      newton.settle = nullptr;
    }
    add(told, minimise(assembly, material, steps, newton, next, context));
    const bool folds = step > options.folds_below && inverts(out.newton.total, told.total);
    const bool good = told.converged && !folds;
    if (!good) {
      told.converged = false;
      told.total = out.newton.total;
      add(out.newton, std::move(told));
      ++out.refused;
      folds_at = folds ? t : folds_at;
      step = (t - out.reached) / 2;
      continue;
    }
    add(out.newton, std::move(told));
    x = std::move(next);
    out.reached = t;
    ++out.steps;
    step = std::min(options.first_step, 2 * step);
    // They come anew however they are come to: no stride beyond them before small steps are there.
    if (out.reached < folds_at)
      step = std::min(step, std::max((folds_at - out.reached) / 2, options.folds_below));
    context.report(t);
  }
  if (out.reached < 1) out.newton.converged = false;
  return out;
}

}  // namespace ecorche::fem
