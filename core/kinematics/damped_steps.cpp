// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/damped_steps.hpp"

#include <algorithm>
#include <cmath>

namespace ecorche::kinematics {
namespace {

constexpr int kRounds = 4;

// Four sums side by side, since additions wait for each other.
double dot(const double* a, const double* b, std::size_t n) {
  double sum[4] = {0, 0, 0, 0};
  std::size_t i = 0;
  for (; i + 4 <= n; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) sum[k] += a[i + k] * b[i + k];
  }
  for (; i < n; ++i) sum[0] += a[i] * b[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// L L' of the lower triangle of a positive definite matrix, row by row.
void factorise(double* a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    double* row = a + i * n;
    for (std::size_t k = 0; k < i; ++k) {
      const double* other = a + k * n;
      row[k] = (row[k] - dot(row, other, k)) * other[k];  // the diagonal holds reciprocals
    }
    row[i] = 1 / std::sqrt(row[i] - dot(row, row, i));
  }
}

void back_substitute(const double* a, double* b, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) b[i] = (b[i] - dot(a + i * n, b, i)) * a[i * n + i];
  for (std::size_t i = n; i-- > 0;) {
    b[i] *= a[i * n + i];
    for (std::size_t k = 0; k < i; ++k) b[k] -= a[i * n + k] * b[i];
  }
}

}  // namespace

DampedSteps::DampedSteps(std::size_t rows, std::size_t columns)
    : rows_(rows),
      columns_(columns),
      size_(std::min(rows, columns)),
      wide_(rows <= columns),
      jacobian_(rows * columns),
      gathered_(size_ * size_),
      matrix_(size_ * size_),
      factor_(size_ * size_),
      left_(rows),
      work_(size_),
      asked_(columns),
      fixed_(columns) {}

void DampedSteps::clear() {
  std::fill(jacobian_.begin(), jacobian_.end(), 0.0);
}

void DampedSteps::gather() {
  if (!wide_) {
    for (std::size_t i = 0; i < columns_; ++i)
      for (std::size_t k = 0; k <= i; ++k)
        gathered_[i * size_ + k] = dot(&jacobian_[i * rows_], &jacobian_[k * rows_], rows_);
    return;
  }
  std::fill(gathered_.begin(), gathered_.end(), 0.0);
  for (std::size_t c = 0; c < columns_; ++c) {
    const double* column = &jacobian_[c * rows_];
    for (std::size_t i = 0; i < rows_; ++i) {
      if (column[i] == 0) continue;
      double* row = &gathered_[i * size_];
      for (std::size_t k = 0; k <= i; ++k) row[k] += column[i] * column[k];
    }
  }
}

// Takes an unknown out of the normal matrix.
void DampedSteps::release(std::size_t c) {
  if (!wide_) {
    for (std::size_t k = 0; k < c; ++k) matrix_[c * size_ + k] = 0;
    for (std::size_t i = c; i < size_; ++i) matrix_[i * size_ + c] = 0;
    return;
  }
  const double* column = &jacobian_[c * rows_];
  for (std::size_t i = 0; i < rows_; ++i) {
    double* row = &matrix_[i * size_];
    for (std::size_t k = 0; k <= i; ++k) row[k] -= column[i] * column[k];
  }
}

void DampedSteps::ask(double damping) {
  factor_ = matrix_;
  for (std::size_t i = 0; i < size_; ++i) factor_[i * size_ + i] += damping * damping;
  factorise(factor_.data(), size_);
  const auto slope = [&](std::size_t c, const std::vector<double>& of) {
    return fixed_[c] != 0 ? 0 : dot(&jacobian_[c * rows_], of.data(), rows_);
  };
  if (wide_) {
    work_ = left_;
    back_substitute(factor_.data(), work_.data(), size_);
    for (std::size_t c = 0; c < columns_; ++c) asked_[c] = slope(c, work_);
  } else {
    for (std::size_t c = 0; c < columns_; ++c) asked_[c] = slope(c, left_);
    back_substitute(factor_.data(), asked_.data(), size_);
  }
}

void DampedSteps::solve(std::span<const double> errors, double damping, std::span<const StepBounds> bounds,
                        std::span<double> x) {
  std::copy(errors.begin(), errors.end(), left_.begin());
  std::fill(fixed_.begin(), fixed_.end(), 0);
  matrix_ = gathered_;
  for (int round = 0; round < kRounds; ++round) {
    ask(damping);
    bool more = false;
    for (std::size_t c = 0; c < columns_; ++c) {
      if (fixed_[c] != 0) continue;
      x[c] = std::clamp(asked_[c], bounds[c].low, bounds[c].high);
      if (x[c] == asked_[c]) continue;
      fixed_[c] = 1;
      more = true;
      const double* column = &jacobian_[c * rows_];
      for (std::size_t i = 0; i < rows_; ++i) left_[i] -= column[i] * x[c];
      release(c);
    }
    if (!more) break;
  }
}

}  // namespace ecorche::kinematics
