// SPDX-License-Identifier: Apache-2.0
// Siddon85 as Jacobs98 walks it: the exact way of a ray through every voxel, each of which is a box of one
// value. The other model of a scan: tests hold Joseph82 against it, and a bench its accuracy and time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <ecorche/values/image.hpp>

namespace ecorche::test {

/// The integral from `from` to `to`, LPS mm, of `value(offset)` over an image on `grid`.
template <class Value>
double siddon(const ImageGrid& grid, const std::array<double, 3>& from, const std::array<double, 3>& to,
              Value&& value) {
  const std::array<double, 3> a = grid.index(from), b = grid.index(to);
  double length = 0, begin = 0, end = 1;
  std::array<double, 3> way{}, next{}, step{};
  for (std::size_t i = 0; i < 3; ++i) {
    length += (to[i] - from[i]) * (to[i] - from[i]);
    way[i] = b[i] - a[i];
    // Voxels reach half of one beyond their centres.
    const double low = -0.5, high = grid.size[i] - 0.5;
    if (way[i] == 0) {
      if (a[i] < low || a[i] >= high) return 0;
      continue;
    }
    const double one = (low - a[i]) / way[i], other = (high - a[i]) / way[i];
    begin = std::max(begin, std::min(one, other));
    end = std::min(end, std::max(one, other));
  }
  if (begin >= end) return 0;
  length = std::sqrt(length);
  std::array<std::int32_t, 3> at{}, turn{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double here = a[i] + begin * way[i];
    at[i] = std::clamp(static_cast<std::int32_t>(std::floor(here + 0.5)), 0, grid.size[i] - 1);
    turn[i] = way[i] < 0 ? -1 : 1;
    if (way[i] == 0) {
      next[i] = step[i] = std::numeric_limits<double>::infinity();
    } else {
      step[i] = 1 / std::abs(way[i]);
      next[i] = (at[i] + 0.5 * turn[i] - a[i]) / way[i];
    }
  }
  const std::array<std::ptrdiff_t, 3> stride{
      turn[0], turn[1] * std::ptrdiff_t{grid.size[0]},
      turn[2] * std::ptrdiff_t{grid.size[0]} * std::ptrdiff_t{grid.size[1]}};
  auto offset = static_cast<std::ptrdiff_t>(grid.offset(at[0], at[1], at[2]));
  double sum = 0, now = begin;
  while (true) {
    const std::size_t i = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const double until = std::min(next[i], end);
    sum += std::max(0.0, until - now) * static_cast<double>(value(static_cast<std::size_t>(offset)));
    now = std::max(now, until);
    if (next[i] >= end) return sum * length;
    at[i] += turn[i];
    if (at[i] < 0 || at[i] >= grid.size[i]) return sum * length;
    offset += stride[i];
    next[i] += step[i];
  }
}

}  // namespace ecorche::test
