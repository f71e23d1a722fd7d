// SPDX-License-Identifier: Apache-2.0
// How far two posed bodies are apart.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace ecorche::runtime {

/// Of any coordinate, mm; `a` and `b` are as long.
inline double largest_step(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(a[i] - b[i])));
  return worst;
}

}  // namespace ecorche::runtime
