// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/monotone.hpp"

#include <algorithm>
#include <utility>

#include "preprocess/weights/worst_row.hpp"

namespace ecorche::weights {
namespace {

/// How far each row of a free node has left [0, 1].
std::vector<double> violations(const std::vector<std::uint8_t>& fixed, MonotoneResult& result) {
  std::vector<double> left(fixed.size(), 0);
  const Worst worst = worst_row(fixed, [&](std::size_t n) {
    const auto row = result.harmonic.values.row(static_cast<Eigen::Index>(n));
    return left[n] = std::max({0.0, -row.minCoeff(), row.maxCoeff() - 1});
  });
  result.violation = worst.value;
  if (worst.node >= 0) result.worst_node = worst.node;
  return left;
}

/// Moves the positive off-diagonals of marked rows onto the diagonals.
void drop_positive_ties(solve::SparseMatrix& L, const std::vector<std::uint8_t>& marked) {
  Eigen::VectorXd added = Eigen::VectorXd::Zero(L.rows());
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      if (entry.row() == c || entry.value() <= 0) continue;
      if (!marked[static_cast<std::size_t>(c)] && !marked[static_cast<std::size_t>(entry.row())]) continue;
      added(c) += entry.value();
      added(entry.row()) += entry.value();
      entry.valueRef() = 0;
    }
  }
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    L.valuePtr()[L.outerIndexPtr()[c]] +=
        added(c);  // a column of the lower triangle starts with its diagonal
  }
}

}  // namespace

MonotoneResult solve_monotone(solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                              solve::Block boundary, solve::SpdSolver& solver, const Context& context) {
  MonotoneResult result;
  result.harmonic = solve_harmonic(L, fixed, std::move(boundary), solver, context);
  std::vector<double> left = violations(fixed, result);
  result.first_violation = result.violation;
  solve::Block first;
  if (result.violation > kSmallViolation) first = result.harmonic.values;
  const auto most = static_cast<std::int64_t>(kMostMended * static_cast<double>(fixed.size()));
  std::vector<std::uint8_t> marked(fixed.size(), 0);
  const Context quiet = context.quiet();  // progress has come to its end with the first solution
  while (result.violation > kSmallViolation) {
    const std::int64_t before = result.mended_nodes;
    for (std::size_t n = 0; n < fixed.size(); ++n) {
      if (marked[n] || left[n] <= kSmallViolation / 2) continue;
      marked[n] = 1;
      ++result.mended_nodes;
    }
    if (result.mended_nodes > most || result.mended_nodes == before) break;
    drop_positive_ties(L, marked);
    result.harmonic = solve_harmonic(L, fixed, std::move(result.harmonic.values), solver, quiet);
    left = violations(fixed, result);
  }
  if (result.mended_nodes > 0) {
    result.largest_change = worst_row(fixed, [&](std::size_t n) {
                              const auto row = static_cast<Eigen::Index>(n);
                              return (result.harmonic.values.row(row) - first.row(row)).cwiseAbs().maxCoeff();
                            }).value;
  }
  return result;
}

}  // namespace ecorche::weights
