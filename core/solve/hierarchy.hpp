// SPDX-License-Identifier: Apache-2.0
// Smoothed aggregation (Vanek, Mandel, Brezina 1996): ever coarser systems that keep the smooth errors of the
// finer ones.
#pragma once

#include <vector>

#include "core/solve/csr.hpp"

namespace ecorche::solve {

/// One level: its matrix, and the way down to the next.
struct Level {
  Csr<double> A;
  Csr<double> P;       ///< rows of this level by unknowns of the next; empty on the coarsest
  double largest = 0;  ///< estimate, from above, of the largest eigenvalue of D^-1 A
};

/// The groups that the unknowns of A fall into, -1 for one that is tied strongly to nothing. `strength`:
/// a_ij ties where a_ij^2 > strength^2 a_ii a_jj. First every unknown whose strong neighbours are all free
/// makes a group with them, in order; then what is left joins its strongest neighbour's.
std::vector<std::int32_t> aggregate(const Csr<double>& A, double strength);

/// (I - w D^-1 A_F) P_0 with w = 4 / 3 over the largest eigenvalue: P_0 is constant on each group, A_F is A
/// with weak entries added to the diagonal.
Csr<double> smoothed_prolongator(const Csr<double>& A, const std::vector<std::int32_t>& group,
                                 double strength, double largest);

/// Power iteration on D^-1 A from a fixed start, times 1.1.
double largest_eigenvalue(const Csr<double>& A);

/// From A down to at most `coarsest` unknowns, or to where groups no longer grow.
std::vector<Level> hierarchy(Csr<double> A, std::int32_t coarsest, const Context& context);

}  // namespace ecorche::solve
