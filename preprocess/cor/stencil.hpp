// SPDX-License-Identifier: Apache-2.0
// Cubic Lagrange interpolation on a uniform grid, and its transpose, which spreads a value over grid points.
#pragma once

#include <algorithm>
#include <array>

namespace ecorche::cor {

/// Four neighbouring grid points and their weights: f(u) = sum w[i] f(first + i), exact for cubics. Error
/// 3/128 h^4 f'''' inside; the stencil is one-sided in the first and last cell.
struct CubicStencil {
  int first = 0;
  std::array<float, 4> w{};

  /// `u` in grid steps, on the points 0 .. last (last >= 3).
  CubicStencil(float u, int last) {
    first = std::clamp(static_cast<int>(u) - 1, 0, last - 3);
    const float x = u - static_cast<float>(first);
    const float a = x, b = x - 1, c = x - 2, d = x - 3;
    w = {b * c * d * (-1.0F / 6), a * c * d * 0.5F, a * b * d * -0.5F, a * b * c * (1.0F / 6)};
  }
};

}  // namespace ecorche::cor
