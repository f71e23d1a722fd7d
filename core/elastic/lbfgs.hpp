// SPDX-License-Identifier: Apache-2.0
// Limited-memory BFGS with backtracking (Nocedal and Wright, Numerical Optimization 2006, algorithms 7.4
// and 3.1).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <deque>
#include <vector>

namespace ecorche::elastic {

/// A step and what it did to the gradient; rho = 1 / (s . y).
struct LbfgsPair {
  Eigen::VectorXd s, y;
  double rho;
};

/// Makes `f(x, gradient)` smaller from x on, in at most `steps` steps; returns how many were made.
/// `initial(direction, newest)` multiplies by a first estimate of the inverse Hessian, for which it may look
/// at the newest pair; null at first, and after the memory was of no use. Ends after a step s that is
/// `enough(s)`.
template <class F, class Initial, class Enough>
int lbfgs(const F& f, const Initial& initial, const Enough& enough, Eigen::VectorXd& x, int steps) {
  constexpr std::size_t kMemory = 8;
  constexpr double kArmijo = 1e-4;
  constexpr int kHalvings = 60;  // of a node far off its place the first step is absurdly long
  std::deque<LbfgsPair> pairs;
  Eigen::VectorXd gradient(x.size()), next_gradient(x.size()), direction, next;
  double value = f(x, gradient);
  for (int step = 0; step < steps; ++step) {
    if (gradient.lpNorm<Eigen::Infinity>() == 0) return step;
    direction = -gradient;
    std::vector<double> alpha(pairs.size());
    for (std::size_t i = pairs.size(); i-- > 0;) {
      alpha[i] = pairs[i].rho * pairs[i].s.dot(direction);
      direction -= alpha[i] * pairs[i].y;
    }
    initial(direction, pairs.empty() ? nullptr : &pairs.back());
    for (std::size_t i = 0; i < pairs.size(); ++i)
      direction += (alpha[i] - pairs[i].rho * pairs[i].y.dot(direction)) * pairs[i].s;
    const double slope = direction.dot(gradient);
    double length = 1, next_value = 0;
    bool lower = false;
    for (int halving = 0; halving < kHalvings && !lower; ++halving, length /= 2) {
      next = x + length * direction;
      next_value = f(next, next_gradient);
      lower = std::isfinite(next_value) && next_value <= value + kArmijo * length * slope;
    }
    if (!lower) {
      if (pairs.empty()) return step;
      pairs.clear();  // once more along the gradient
      continue;
    }
    LbfgsPair pair{next - x, next_gradient - gradient, 0};
    const double curvature = pair.s.dot(pair.y);
    x.swap(next);
    gradient.swap(next_gradient);
    value = next_value;
    if (enough(pair.s)) return step + 1;
    if (curvature <= 1e-12 * pair.s.norm() * pair.y.norm()) continue;
    pair.rho = 1 / curvature;
    pairs.push_back(std::move(pair));
    if (pairs.size() > kMemory) pairs.pop_front();
  }
  return steps;
}

/// The same by the gradient alone: a step without memory moves no entry by more than `first_step`.
template <class F>
int lbfgs(const F& f, Eigen::VectorXd& x, int steps, double first_step) {
  const auto initial = [first_step](Eigen::VectorXd& direction, const LbfgsPair* newest) {
    direction *= newest == nullptr ? first_step / direction.lpNorm<Eigen::Infinity>()
                                   : 1 / (newest->rho * newest->y.squaredNorm());
  };
  return lbfgs(
      f, initial, [](const Eigen::VectorXd&) { return false; }, x, steps);
}

}  // namespace ecorche::elastic
