// SPDX-License-Identifier: Apache-2.0
// The slow, obvious twins of preprocess/thin, and objects to try them on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "preprocess/thin/distance.hpp"
#include "preprocess/thin/mask.hpp"

namespace ecorche::thin {

using Index = std::array<std::int32_t, 3>;

inline Mask make_mask(const Index& size, const std::function<bool(int, int, int)>& inside) {
  Mask mask;
  mask.grid.size = size;
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) mask.inside.push_back(inside(i, j, k) ? 1 : 0);
    }
  }
  return mask;
}

inline Mask random_mask(const Index& size, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::bernoulli_distribution coin(share);
  return make_mask(size, [&](int, int, int) { return coin(random); });
}

/// Half axes in voxels, centred.
inline Mask ellipsoid(const Index& size, const std::array<double, 3>& half) {
  return make_mask(size, [&](int i, int j, int k) {
    const double x = (i - (size[0] - 1) / 2.0) / half[0], y = (j - (size[1] - 1) / 2.0) / half[1],
                 z = (k - (size[2] - 1) / 2.0) / half[2];
    return x * x + y * y + z * z < 1;
  });
}

/// The least of `cost(|di|, |dj|, |dk|)` over all background voxels, one layer beyond the image among them.
template <class T, class Cost>
std::vector<T> brute_distance(const Mask& mask, Cost&& cost) {
  const Index& n = mask.grid.size;
  std::vector<Index> background;
  for (int k = -1; k <= n[2]; ++k) {
    for (int j = -1; j <= n[1]; ++j) {
      for (int i = -1; i <= n[0]; ++i) {
        const bool in = i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2];
        if (!in || mask.inside[mask.grid.offset(i, j, k)] == 0) background.push_back({i, j, k});
      }
    }
  }
  std::vector<T> out;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        T best = std::numeric_limits<T>::max();
        if (mask.inside[mask.grid.offset(i, j, k)] == 0) {
          best = 0;
        } else {
          for (const Index& b : background)
            best = std::min(best, cost(std::abs(b[0] - i), std::abs(b[1] - j), std::abs(b[2] - k)));
        }
        out.push_back(best);
      }
    }
  }
  return out;
}

inline std::uint32_t euclidean_cost(int a, int b, int c) {
  return static_cast<std::uint32_t>(a * a + b * b + c * c);
}

inline std::uint32_t chamfer_cost(int a, int b, int c) {
  std::array<int, 3> d{a, b, c};
  std::sort(d.begin(), d.end());
  return static_cast<std::uint32_t>(5 * d[0] + 4 * (d[1] - d[0]) + 3 * (d[2] - d[1]));
}

inline std::vector<std::uint32_t> values_of(const DistanceMap& map) {
  std::vector<std::uint32_t> out;
  std::visit([&](const auto& v) { out.assign(v.data(), v.data() + v.size()); }, map.values);
  return out;
}

}  // namespace ecorche::thin
