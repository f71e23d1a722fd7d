// SPDX-License-Identifier: Apache-2.0
// One step of damped least squares within bounds, on plain arrays: the solver's inner loop.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace ecorche::kinematics {

/// How far each unknown may go in this step: low <= 0 <= high.
struct StepBounds {
  double low = 0, high = 0;
};

/// Steps of `J x = e`. `J` has a row for each error and a column for each unknown; storage is made once.
class DampedSteps {
 public:
  DampedSteps(std::size_t rows, std::size_t columns);

  /// Column c of J, #rows, to be filled by the caller; then `gather`.
  std::span<double> column(std::size_t c) { return {jacobian_.data() + c * rows_, rows_}; }
  void clear();
  /// J J' (or J' J where there are more errors than unknowns), for every step with this J.
  void gather();

  /// Least |J x - e|^2 + damping^2 |x|^2 by Cholesky's factors of the smaller normal matrix (Wampler 1986).
  /// An unknown that would pass its bound goes up to it, and the others are asked again for what is left: at
  /// most four rounds. `damping` > 0.
  void solve(std::span<const double> errors, double damping, std::span<const StepBounds> bounds,
             std::span<double> x);

 private:
  void release(std::size_t c);
  void ask(double damping);

  std::size_t rows_, columns_, size_;
  bool wide_;  // fewer errors than unknowns: J J'
  std::vector<double> jacobian_, gathered_, matrix_, factor_, left_, work_, asked_;
  std::vector<char> fixed_;
};

}  // namespace ecorche::kinematics
