// SPDX-License-Identifier: Apache-2.0
#include "core/solve/csr.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace ecorche::solve {

Csr<double> both_triangles(const SparseMatrix& A) {
  Csr<double> out;
  out.rows = out.columns = static_cast<std::int32_t>(A.rows());
  out.first.assign(static_cast<std::size_t>(A.rows()) + 1, 0);
  const auto for_entries = [&](auto&& f) {
    for (Eigen::Index c = 0; c < A.outerSize(); ++c) {
      for (SparseMatrix::InnerIterator entry(A, c); entry; ++entry) {
        if (entry.row() < c) continue;
        const auto row = static_cast<std::int32_t>(entry.row()), column = static_cast<std::int32_t>(c);
        f(row, column, entry.value());
        if (row != column) f(column, row, entry.value());
      }
    }
  };
  for_entries(
      [&](std::int32_t row, std::int32_t, double) { ++out.first[static_cast<std::size_t>(row) + 1]; });
  for (std::size_t r = 1; r < out.first.size(); ++r) out.first[r] += out.first[r - 1];
  out.column.resize(static_cast<std::size_t>(out.first.back()));
  out.value.resize(out.column.size());
  // Columns come in order, so that those below the diagonal of a row come ascending, and then those above.
  std::vector<std::int64_t> at(out.first.begin(), out.first.end() - 1);
  for_entries([&](std::int32_t row, std::int32_t column, double value) {
    const auto slot = static_cast<std::size_t>(at[static_cast<std::size_t>(row)]++);
    out.column[slot] = column;
    out.value[slot] = value;
  });
  return out;
}

Csr<double> transpose(const Csr<double>& A) {
  Csr<double> out;
  out.rows = A.columns;
  out.columns = A.rows;
  out.first.assign(static_cast<std::size_t>(A.columns) + 1, 0);
  for (const std::int32_t c : A.column) ++out.first[static_cast<std::size_t>(c) + 1];
  for (std::size_t r = 1; r < out.first.size(); ++r) out.first[r] += out.first[r - 1];
  out.column.resize(A.column.size());
  out.value.resize(A.value.size());
  std::vector<std::int64_t> at(out.first.begin(), out.first.end() - 1);
  for (std::int32_t row = 0; row < A.rows; ++row) {
    A.for_row(row, [&](std::int32_t column, double value) {
      const auto slot = static_cast<std::size_t>(at[static_cast<std::size_t>(column)]++);
      out.column[slot] = row;
      out.value[slot] = value;
    });
  }
  return out;
}

Csr<double> join(std::int32_t rows, std::int32_t columns, std::vector<RowsPart>& parts) {
  Csr<double> out;
  out.rows = rows;
  out.columns = columns;
  out.first.reserve(static_cast<std::size_t>(rows) + 1);
  for (const RowsPart& part : parts) {
    for (const std::int32_t length : part.length) out.first.push_back(out.first.back() + length);
  }
  out.column.resize(static_cast<std::size_t>(out.first.back()));
  out.value.resize(static_cast<std::size_t>(out.first.back()));
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    const auto at = out.first[p * static_cast<std::size_t>(RowsPart::rows)];
    std::copy(parts[p].column.begin(), parts[p].column.end(), out.column.begin() + at);
    std::copy(parts[p].value.begin(), parts[p].value.end(), out.value.begin() + at);
    parts[p] = {};
  });
  return out;
}

Csr<double> multiply(const Csr<double>& A, const Csr<double>& B) {
  constexpr std::int32_t kRows = RowsPart::rows;
  struct Sums {
    std::vector<double> sum;
    std::vector<std::uint8_t> live;
    std::vector<std::int32_t> columns;
  };
  std::vector<RowsPart> parts(static_cast<std::size_t>((A.rows + kRows - 1) / kRows));
  tbb::enumerable_thread_specific<Sums> scratch([&] {
    const auto columns = static_cast<std::size_t>(B.columns);
    return Sums{std::vector<double>(columns, 0), std::vector<std::uint8_t>(columns, 0), {}};
  });
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
    Sums& s = scratch.local();
    RowsPart& part = parts[p];
    const auto begin = static_cast<std::int32_t>(p) * kRows, end = std::min(begin + kRows, A.rows);
    for (std::int32_t row = begin; row < end; ++row) {
      s.columns.clear();
      A.for_row(row, [&](std::int32_t middle, double a) {
        B.for_row(middle, [&](std::int32_t column, double b) {
          const auto c = static_cast<std::size_t>(column);
          if (s.live[c] == 0) s.columns.push_back(column);
          s.live[c] = 1;
          s.sum[c] += a * b;
        });
      });
      std::sort(s.columns.begin(), s.columns.end());
      for (const std::int32_t column : s.columns) {
        const auto c = static_cast<std::size_t>(column);
        part.column.push_back(column);
        part.value.push_back(s.sum[c]);
        s.sum[c] = 0;
        s.live[c] = 0;
      }
      part.length.push_back(static_cast<std::int32_t>(s.columns.size()));
    }
  });
  return join(A.rows, B.columns, parts);
}

Csr<float> narrow(const Csr<double>& A) {
  return {A.rows, A.columns, A.first, A.column, std::vector<float>(A.value.begin(), A.value.end())};
}

std::vector<double> diagonal(const Csr<double>& A) {
  std::vector<double> out(static_cast<std::size_t>(A.rows), 0);
  for (std::int32_t row = 0; row < A.rows; ++row) {
    A.for_row(row, [&](std::int32_t column, double value) {
      if (column == row) out[static_cast<std::size_t>(row)] = value;
    });
  }
  return out;
}

}  // namespace ecorche::solve
