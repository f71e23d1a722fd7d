// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {

double relative_residual(const SparseMatrix& A, const Block& X, const Block& B) {
  double worst = 0;
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    const Eigen::VectorXd r = A.selfadjointView<Eigen::Lower>() * X.col(c) - B.col(c);
    const double b = B.col(c).norm();
    // A zero right-hand side has only the zero solution: the residual then counts as it is.
    worst = std::max(worst, b > 0 ? r.norm() / b : r.norm());
  }
  return worst;
}

}  // namespace ecorche::solve
