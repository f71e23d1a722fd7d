// SPDX-License-Identifier: Apache-2.0
// Laplace's equation with the fixed nodes eliminated: L_ff X_f = -L_fb B, only the free block is factored.
#include "preprocess/weights/harmonic.hpp"

#include <string>

namespace ecorche::weights {
namespace {

/// The free block of L (lower triangle) and the right-hand sides -L_fb B, in the order of the free nodes.
struct FreeSystem {
  solve::SparseMatrix A;
  solve::Block rhs;
};

/// Right angles tie nothing: six of the fourteen neighbours of a node of the lattice.
bool vanishes(const solve::SparseMatrix::InnerIterator& entry) {
  return entry.value() == 0 && entry.row() != entry.col();
}

FreeSystem eliminate(const solve::SparseMatrix& L, const std::vector<std::int32_t>& free_row,
                     std::int32_t free_count, const solve::Block& boundary) {
  FreeSystem system;
  system.A.resize(free_count, free_count);
  system.rhs.setZero(free_count, boundary.cols());
  std::int32_t* offsets = system.A.outerIndexPtr();
  const auto row_of = [&](Eigen::Index n) { return free_row[static_cast<std::size_t>(n)]; };

  // Free rows keep the order of the nodes, so the lower triangle stays lower.
  offsets[0] = 0;
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    if (row_of(c) < 0) continue;
    std::int32_t count = 0;
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      count += row_of(entry.row()) >= 0 && !vanishes(entry);
    }
    offsets[row_of(c) + 1] = offsets[row_of(c)] + count;
  }
  system.A.resizeNonZeros(offsets[free_count]);
  for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
    const std::int32_t column = row_of(c);
    std::int32_t at = column < 0 ? 0 : offsets[column];
    for (solve::SparseMatrix::InnerIterator entry(L, c); entry; ++entry) {
      if (vanishes(entry)) continue;
      const std::int32_t row = row_of(entry.row());
      if (row >= 0 && column >= 0) {
        system.A.innerIndexPtr()[at] = row;
        system.A.valuePtr()[at++] = entry.value();
      } else if (row >= 0) {
        system.rhs.row(row) -= entry.value() * boundary.row(c);
      } else if (column >= 0) {
        system.rhs.row(column) -= entry.value() * boundary.row(entry.row());
      }
    }
  }
  return system;
}

}  // namespace

HarmonicResult solve_harmonic(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                              const solve::Block& boundary, solve::SpdSolver& solver,
                              const Context& context) {
  std::vector<std::int32_t> free_row(fixed.size(), -1);
  std::int32_t free_count = 0;
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (!fixed[n]) free_row[n] = free_count++;
  }
  HarmonicResult result;
  result.values = boundary;
  if (free_count == 0) return result;
  if (free_count == static_cast<std::int32_t>(fixed.size())) {
    throw Error(ErrorKind::data, "weights", "no node is fixed", "the mesh must touch at least one bone");
  }
  const FreeSystem system = eliminate(L, free_row, free_count, boundary);
  context.check_stop();
  solver.factor(system.A, context);
  context.report(0.6);
  const solve::Block X = solver.solve(system.rhs, context);
  context.report(0.9);
  result.residual = solve::relative_residual(system.A, X, system.rhs);
  for (std::size_t n = 0; n < fixed.size(); ++n) {
    if (free_row[n] >= 0) result.values.row(static_cast<Eigen::Index>(n)) = X.row(free_row[n]);
  }
  return result;
}

}  // namespace ecorche::weights
