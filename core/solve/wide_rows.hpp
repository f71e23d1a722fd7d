// SPDX-License-Identifier: Apache-2.0
// Blocks of vectors in float, a row an unknown and a column a right-hand side: the work of a multigrid cycle
// (Highway).
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "core/solve/csr.hpp"

namespace ecorche::solve {

/// Columns come in multiples of this many: a row is whole vectors.
inline constexpr std::size_t kLanes = 8;
/// Most columns of a block: what a matrix's row gathers stays in the first cache.
inline constexpr std::size_t kMostColumns = 32;

using Wide = std::vector<float>;  ///< #rows by `width`, row by row

/// Rows that one piece of work takes: a few vectors of them stay in the second cache, so that what follows a
/// product within the piece costs no memory.
inline constexpr std::size_t kRowsAtOnce = 512;

/// Calls f(part, begin, end) for ranges of rows that do not depend on the number of threads.
template <class F>
void for_parts(std::size_t rows, F&& f) {
  tbb::parallel_for(std::size_t{0}, (rows + kRowsAtOnce - 1) / kRowsAtOnce, [&](std::size_t part) {
    f(part, part * kRowsAtOnce, std::min((part + 1) * kRowsAtOnce, rows));
  });
}

/// out = product A x + the addends. `out` may be the rows of an addend, not x.
struct Combination {
  struct Addend {
    const float* rows = nullptr;  ///< none where null
    float times = 0;
  };
  const Csr<float>* A = nullptr;
  const float* x = nullptr;
  float product = 1;
  std::array<Addend, 3> addends{};  ///< the first ones are given, the others null
  float* out = nullptr;
  std::size_t width = 0;
};
void combine(const Combination& job, std::size_t begin, std::size_t end);

/// sums[c] += sum over the rows of a b, #width. Summed in float: of at most kRowsAtOnce rows at a time.
void add_dots(const float* a, const float* b, std::size_t width, std::size_t begin, std::size_t end,
              double* sums);

/// x += alpha p, r -= alpha q; alpha is #width.
void advance(const float* alpha, const float* p, const float* q, float* x, float* r, std::size_t width,
             std::size_t begin, std::size_t end);

/// p = z + beta p; beta is #width.
void turn(const float* beta, const float* z, float* p, std::size_t width, std::size_t begin, std::size_t end);

}  // namespace ecorche::solve
