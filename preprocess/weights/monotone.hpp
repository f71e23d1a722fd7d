// SPDX-License-Identifier: Apache-2.0
// Where slivers make linear elements leave [0, 1] by more than a little: their ties are mended, and only
// theirs.
#pragma once

#include <cstdint>
#include <vector>

#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {

inline constexpr double kSmallViolation = 1e-3;  ///< what a solution may leave [0, 1] by
inline constexpr double kMostMended = 0.02;      ///< of all nodes: a mesh with more is refused

struct MonotoneResult {
  HarmonicResult harmonic;
  std::int64_t mended_nodes = 0;  ///< nodes whose positive off-diagonals were dropped
  double first_violation = 0;     ///< how far the solution on the whole mesh had left [0, 1]
  double largest_change = 0;      ///< of a value, from that solution to the last
  double violation = 0;  ///< how far the last one does; beyond kSmallViolation the mesh is to be refused
  std::int32_t worst_node = -1;  ///< where the last one does
};

/// solve_harmonic, held within [-1e-3, 1 + 1e-3]. A node that leaves the bounds has an obtuse tet beside a
/// steep change of the weights (two bones a tet apart): one of its ties L_ab is positive, and pushes its
/// value away from its neighbour's. While any row violates by more than kSmallViolation, the positive
/// off-diagonals of the rows that violate by more than half of it are dropped (moved onto both diagonals: the
/// matrix stays symmetric and definite, its rows still sum to 0, and such a row becomes a mean of its
/// neighbours), and the system is factored and solved again. A mesh with small violations is solved once and
/// untouched. Dropping every positive off-diagonal would move weights by up to 0.14 all over the body, so for
/// a mesh that asks for more than kMostMended of its nodes this gives up. `L` is mended in place: Eigen's
/// sparse matrices cannot be moved, and a copy takes as much again.
MonotoneResult solve_monotone(solve::SparseMatrix& L, const std::vector<std::uint8_t>& fixed,
                              solve::Block boundary, solve::SpdSolver& solver, const Context& context);

}  // namespace ecorche::weights
