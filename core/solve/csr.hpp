// SPDX-License-Identifier: Apache-2.0
// Sparse matrices by rows, and the two products that a multigrid hierarchy is built with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/solve/raw_vector.hpp"
#include "core/solve/spd_solver.hpp"

namespace ecorche::solve {

/// Columns ascend within a row.
template <class T>
struct Csr {
  std::int32_t rows = 0, columns = 0;
  RawVector<std::int64_t> first{0};  ///< rows + 1
  RawVector<std::int32_t> column;
  RawVector<T> value;

  /// Calls f(column, value) for every entry of the row.
  template <class F>
  void for_row(std::int32_t row, F&& f) const {
    const auto r = static_cast<std::size_t>(row);
    for (auto at = static_cast<std::size_t>(first[r]); at < static_cast<std::size_t>(first[r + 1]); ++at)
      f(column[at], value[at]);
  }
};

/// Both triangles of the symmetric matrix whose lower triangle `A` holds.
Csr<double> both_triangles(const SparseMatrix& A);

Csr<double> transpose(const Csr<double>& A);
Csr<float> transpose(const Csr<float>& A);

/// A B, row by row (Gustavson 1978). Parallel, the same for any number of threads.
Csr<double> multiply(const Csr<double>& A, const Csr<double>& B);

/// left_i a_ij right_j, in float.
Csr<float> scaled(const Csr<double>& A, const std::vector<double>& left, const std::vector<double>& right);

/// The entries of so many rows of a matrix under construction: parts are made in parallel and joined.
struct RowsPart {
  static constexpr std::int32_t rows = 4096;
  std::vector<std::int32_t> length;  ///< entries by row
  std::vector<std::int32_t> column;
  std::vector<double> value;
};
/// Parts hold RowsPart::rows rows each, the last one what is left. Takes them apart.
Csr<double> join(std::int32_t rows, std::int32_t columns, std::vector<RowsPart>& parts);

/// The diagonal; 0 where a row has none.
std::vector<double> diagonal(const Csr<double>& A);

}  // namespace ecorche::solve
