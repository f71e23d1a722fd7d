// SPDX-License-Identifier: Apache-2.0
#include "core/solve/csr.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/solve/counting_sort.hpp"

namespace ecorche::solve {

namespace {

template <class T>
Csr<T> transposed(const Csr<T>& A) {
  Csr<T> out;
  out.rows = A.columns;
  out.columns = A.rows;
  CountingSort<std::int64_t> sort(static_cast<std::size_t>(A.columns), static_cast<std::size_t>(A.rows),
                                  [&](std::size_t row, auto&& add) {
                                    A.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, T) {
                                      add(static_cast<std::size_t>(column));
                                    });
                                  });
  out.column.resize(sort.places());
  out.value.resize(sort.places());
  sort.fill([&](std::size_t row, auto&& take) {
    A.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, T value) {
      const std::size_t at = take(static_cast<std::size_t>(column));
      out.column[at] = static_cast<std::int32_t>(row);
      out.value[at] = value;
    });
  });
  out.first = sort.take_offsets();
  return out;
}

template <class F>
void for_rows(std::int32_t rows, F&& f) {
  tbb::parallel_for(tbb::blocked_range<std::int32_t>(0, rows, RowsPart::rows), [&](const auto& range) {
    for (std::int32_t row = range.begin(); row < range.end(); ++row) f(row);
  });
}

}  // namespace

// A row begins with what lies left of its diagonal, columns of the lower triangle in their order, and goes on
// with its own column.
Csr<double> both_triangles(const SparseMatrix& A) {
  Csr<double> out;
  out.rows = out.columns = static_cast<std::int32_t>(A.rows());
  const auto unknowns = static_cast<std::size_t>(A.rows());
  const auto for_column = [&](std::size_t c, auto&& f) {
    for (SparseMatrix::InnerIterator entry(A, static_cast<Eigen::Index>(c)); entry; ++entry) {
      if (entry.row() >= entry.col()) f(static_cast<std::size_t>(entry.row()), entry.value());
    }
  };
  CountingSort<std::int64_t> sort(
      unknowns, unknowns,
      [&](std::size_t c, auto&& add) {
        for_column(c, [&](std::size_t row, double) {
          if (row != c) add(row);
        });
      },
      [&](std::size_t c) {
        std::int64_t own = 0;
        for_column(c, [&](std::size_t, double) { ++own; });
        return own;
      });
  out.column.resize(sort.places());
  out.value.resize(sort.places());
  sort.fill([&](std::size_t c, auto&& take) {
    for_column(c, [&](std::size_t row, double value) {
      if (row == c) return;
      const std::size_t at = take(row);
      out.column[at] = static_cast<std::int32_t>(c);
      out.value[at] = value;
    });
  });
  out.first = sort.take_offsets();
  for_rows(out.rows, [&](std::int32_t c) {
    auto at = static_cast<std::size_t>(out.first[static_cast<std::size_t>(c) + 1]);
    for_column(static_cast<std::size_t>(c), [&](std::size_t, double) { --at; });
    for_column(static_cast<std::size_t>(c), [&](std::size_t row, double value) {
      out.column[at] = static_cast<std::int32_t>(row);
      out.value[at++] = value;
    });
  });
  return out;
}

Csr<double> transpose(const Csr<double>& A) {
  return transposed(A);
}

Csr<float> transpose(const Csr<float>& A) {
  return transposed(A);
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

Csr<float> scaled(const Csr<double>& A, const std::vector<double>& left, const std::vector<double>& right) {
  Csr<float> out{A.rows, A.columns, A.first, A.column, {}};
  out.value.resize(A.value.size());
  for_rows(A.rows, [&](std::int32_t row) {
    auto at = static_cast<std::size_t>(A.first[static_cast<std::size_t>(row)]);
    A.for_row(row, [&](std::int32_t column, double value) {
      out.value[at++] = static_cast<float>(
          value * (left[static_cast<std::size_t>(row)] * right[static_cast<std::size_t>(column)]));
    });
  });
  return out;
}

std::vector<double> diagonal(const Csr<double>& A) {
  std::vector<double> out(static_cast<std::size_t>(A.rows), 0);
  for_rows(A.rows, [&](std::int32_t row) {
    A.for_row(row, [&](std::int32_t column, double value) {
      if (column == row) out[static_cast<std::size_t>(row)] = value;
    });
  });
  return out;
}

}  // namespace ecorche::solve
