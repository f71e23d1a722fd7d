// SPDX-License-Identifier: Apache-2.0
// One axis of the separable distance transform, a vector of columns at a time (Highway).
#pragma once

#include <cstddef>
#include <cstdint>

namespace ecorche::thin {

/// Columns that are looked at together: rows of `n`, each holding `width` of them side by side.
template <class T>
struct WindowJob {
  const T* in = nullptr;      ///< `n` rows; readable up to the next multiple of 64 bytes, with zeros there
  std::size_t in_stride = 0;  ///< values from row to row
  T* out = nullptr;           ///< not `in`; only `width` values of a row are written
  std::size_t out_stride = 0;
  std::size_t n = 0, width = 0;
  const T* cost = nullptr;  ///< of 0 .. n + 1 rows, rising: the axis' part of the distance
};

/// out(q) is the minimum of cost(min(q + 1, n - q)) and of in(p) + cost(|p - q|) over all p: rows -1 and n
/// are background. 16-bit sums stay at 65535, others must not overflow. The window around q ends where its
/// cost alone is no better than what was found.
void window_minimum(const WindowJob<std::uint16_t>& job);
void window_minimum(const WindowJob<std::uint32_t>& job);
void window_minimum(const WindowJob<double>& job);

}  // namespace ecorche::thin
