// SPDX-License-Identifier: Apache-2.0
// Blocks of vectors, a row an unknown and a column a right-hand side, all of one width: the work of a cycle.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/solve/csr.hpp"

namespace ecorche::solve {

/// Right-hand sides are solved so many at a time: a row of floats is one cache line, and wide enough for
/// vectors.
constexpr std::size_t kWidth = 16;

template <class T>
using Rows = std::vector<std::array<T, kWidth>>;

constexpr std::size_t kRowsAtOnce = 2048;

/// Calls f(begin, end) for ranges of rows that do not depend on the number of threads.
template <class F>
void for_rows(std::size_t rows, F&& f) {
  tbb::parallel_for(std::size_t{0}, (rows + kRowsAtOnce - 1) / kRowsAtOnce, [&](std::size_t part) {
    f(part * kRowsAtOnce, std::min((part + 1) * kRowsAtOnce, rows));
  });
}

/// Calls f(row, column) for every number of blocks of so many rows.
template <class F>
void for_each_row(std::size_t rows, F&& f) {
  for_rows(rows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      for (std::size_t c = 0; c < kWidth; ++c) f(row, c);
    }
  });
}

/// out = rhs - A x, or A x where `rhs` is null.
template <class T>
void residual(const Csr<T>& A, const Rows<T>& x, const Rows<T>* rhs, Rows<T>& out) {
  for_rows(static_cast<std::size_t>(A.rows), [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      std::array<T, kWidth> sum{};
      A.for_row(static_cast<std::int32_t>(row), [&](std::int32_t column, T a) {
        const auto& from = x[static_cast<std::size_t>(column)];
        for (std::size_t c = 0; c < kWidth; ++c) sum[c] += a * from[c];
      });
      if (rhs != nullptr) {
        for (std::size_t c = 0; c < kWidth; ++c) sum[c] = (*rhs)[row][c] - sum[c];
      }
      out[row] = sum;
    }
  });
}

/// Per column the sum of a b, in an order that does not depend on the number of threads.
template <class T>
std::array<double, kWidth> dot(const Rows<T>& a, const Rows<T>& b) {
  std::vector<std::array<double, kWidth>> parts((a.size() + kRowsAtOnce - 1) / kRowsAtOnce);
  for_rows(a.size(), [&](std::size_t begin, std::size_t end) {
    std::array<double, kWidth> sum{};
    for (std::size_t row = begin; row < end; ++row) {
      for (std::size_t c = 0; c < kWidth; ++c) sum[c] += static_cast<double>(a[row][c]) * b[row][c];
    }
    parts[begin / kRowsAtOnce] = sum;
  });
  std::array<double, kWidth> out{};
  for (const auto& part : parts) {
    for (std::size_t c = 0; c < kWidth; ++c) out[c] += part[c];
  }
  return out;
}

}  // namespace ecorche::solve
