// SPDX-License-Identifier: Apache-2.0
// Limited-memory BFGS with backtracking (Nocedal and Wright, Numerical Optimization 2006, algorithms 7.4
// and 3.1).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <deque>
#include <vector>

namespace ecorche::runtime {

/// Makes `f(x, gradient)` smaller from x on, in at most `steps` steps; returns how many were made. The first
/// step, and each after the memory was of no use, moves no entry by more than `first_step`.
template <class F>
int lbfgs(const F& f, Eigen::VectorXd& x, int steps, double first_step) {
  constexpr std::size_t kMemory = 8;
  constexpr double kArmijo = 1e-4;
  struct Pair {
    Eigen::VectorXd s, y;
    double rho;
  };
  std::deque<Pair> pairs;
  Eigen::VectorXd gradient(x.size()), next_gradient(x.size()), direction, next;
  double value = f(x, gradient);
  for (int step = 0; step < steps; ++step) {
    const double steepest = gradient.lpNorm<Eigen::Infinity>();
    if (steepest == 0) return step;
    direction = -gradient;
    std::vector<double> alpha(pairs.size());
    for (std::size_t i = pairs.size(); i-- > 0;) {
      alpha[i] = pairs[i].rho * pairs[i].s.dot(direction);
      direction -= alpha[i] * pairs[i].y;
    }
    direction *=
        pairs.empty() ? first_step / steepest : 1 / (pairs.back().rho * pairs.back().y.squaredNorm());
    for (std::size_t i = 0; i < pairs.size(); ++i)
      direction += (alpha[i] - pairs[i].rho * pairs[i].y.dot(direction)) * pairs[i].s;
    const double slope = direction.dot(gradient);
    double length = 1, next_value = 0;
    bool lower = false;
    for (int halving = 0; halving < 20 && !lower; ++halving, length /= 2) {
      next = x + length * direction;
      next_value = f(next, next_gradient);
      lower = std::isfinite(next_value) && next_value <= value + kArmijo * length * slope;
    }
    if (!lower) {
      if (pairs.empty()) return step;
      pairs.clear();  // once more along the gradient
      continue;
    }
    Pair pair{next - x, next_gradient - gradient, 0};
    const double curvature = pair.s.dot(pair.y);
    x.swap(next);
    gradient.swap(next_gradient);
    value = next_value;
    if (curvature <= 1e-12 * pair.s.norm() * pair.y.norm()) continue;
    pair.rho = 1 / curvature;
    pairs.push_back(std::move(pair));
    if (pairs.size() > kMemory) pairs.pop_front();
  }
  return steps;
}

}  // namespace ecorche::runtime
