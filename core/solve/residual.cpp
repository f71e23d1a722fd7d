// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/solve/csr.hpp"

namespace ecorche::solve {

double relative_residual(const SparseMatrix& A, const Block& X, const Block& B) {
  const Csr<double> both = both_triangles(A);
  constexpr std::size_t kRows = 4096;
  const auto rows = static_cast<std::size_t>(B.rows()), columns = static_cast<std::size_t>(B.cols());
  struct Squares {
    std::vector<double> r, b;
  };
  std::vector<Squares> parts((rows + kRows - 1) / kRows);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
    Squares& sums = parts[part];
    sums.r.assign(columns, 0);
    sums.b.assign(columns, 0);
    std::vector<double> r(columns);
    for (std::size_t row = part * kRows; row < std::min((part + 1) * kRows, rows); ++row) {
      const double* const b = B.data() + row * columns;
      std::copy_n(b, columns, r.begin());
      both.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, double a) {
        const double* const x = X.data() + static_cast<std::size_t>(column) * columns;
        for (std::size_t c = 0; c < columns; ++c) r[c] -= a * x[c];
      });
      for (std::size_t c = 0; c < columns; ++c) {
        sums.r[c] += r[c] * r[c];
        sums.b[c] += b[c] * b[c];
      }
    }
  });
  double worst = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    double r2 = 0, b2 = 0;
    for (const Squares& sums : parts) {
      r2 += sums.r[c];
      b2 += sums.b[c];
    }
    // A zero right-hand side has only the zero solution: the residual then counts as it is.
    worst = std::max(worst, b2 > 0 ? std::sqrt(r2 / b2) : std::sqrt(r2));
  }
  return worst;
}

}  // namespace ecorche::solve
