// SPDX-License-Identifier: Apache-2.0
// Solved weights that left [0, 1]: measured, mended close to where it happened, refused when that moves too
// much.
#pragma once

#include <cstdint>
#include <vector>

#include "core/solve/spd_solver.hpp"
#include "core/values/context.hpp"

namespace ecorche::weights {

/// Linear elements keep 0 <= w <= 1 only where no off-diagonal is positive; slivers break it (DESIGN 7).
/// The rule, in two steps:
///   1. Where a row leaves [-1e-3, 1 + 1e-3], its node and two rings of neighbours are solved again, with the
///   nodes
///      around them fixed at their (clamped) values, by an M-matrix: the Laplacian of the patch with its
///      positive off-diagonals dropped. What comes out lies between the values around.
///   2. Every row is clamped to [0, 1] and divided by its sum.
/// Nothing else is touched: dropping positive off-diagonals everywhere would move weights by up to 0.14.
struct Repair {
  std::uint64_t rows = 0;     ///< rows that left [0, 1] by more than 1e-9, or that were solved again
  double largest_change = 0;  ///< of any weight
  double worst_solved = 0;    ///< the weight that changed most, as solved
  std::int32_t worst_node = -1;
  std::int32_t worst_column = -1;
};

inline constexpr double kSmallViolation = 1e-3;  ///< beyond it a row is solved again
inline constexpr double kRounding = 1e-9;  ///< below it a violation is the solver's rounding, not the mesh's

/// `values` is #nodes by #columns, as solved; mended in place. Nodes with fixed[n] never change.
Repair repair(const solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed, Eigen::MatrixXd& values,
              const Context& context);

}  // namespace ecorche::weights
