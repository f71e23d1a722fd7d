// SPDX-License-Identifier: Apache-2.0
#include "tests/support/slow_skeleton.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace ecorche::test {

Image mask_where(const ImageGrid& grid, const std::function<bool(int, int, int)>& inside) {
  Image mask(grid, ScalarType::u8);
  const std::span<std::uint8_t> voxels = mask.scalars<std::uint8_t>();
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) voxels[grid.offset(i, j, k)] = inside(i, j, k) ? 1 : 0;
    }
  }
  return mask;
}

VolumetricSkeleton slow_skeleton(const Image& mask, double thinness) {
  const ImageGrid& grid = mask.grid;
  const auto inside = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < grid.size[0] && j < grid.size[1] && k < grid.size[2] &&
           mask.scalars<std::uint8_t>()[grid.offset(i, j, k)] != 0;
  };
  // The nearest background voxel touches the object, so only those are looked at.
  std::vector<std::array<int, 3>> rim;
  for (int k = -1; k <= grid.size[2]; ++k) {
    for (int j = -1; j <= grid.size[1]; ++j) {
      for (int i = -1; i <= grid.size[0]; ++i) {
        if (inside(i, j, k)) continue;
        bool touches = false;
        for (int n = 0; n < 27; ++n)
          touches = touches || inside(i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1);
        if (touches) rim.push_back({i, j, k});
      }
    }
  }
  std::vector<std::uint32_t> distance(grid.voxels());
  const auto each = [&](auto&& f) {
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          if (inside(i, j, k)) f(i, j, k);
        }
      }
    }
  };
  each([&](int i, int j, int k) {
    int least = 1 << 30;
    for (const auto& [x, y, z] : rim)
      least = std::min(least, (x - i) * (x - i) + (y - j) * (y - j) + (z - k) * (z - k));
    distance[grid.offset(i, j, k)] = static_cast<std::uint32_t>(least);
  });

  VolumetricSkeleton out;
  out.name = "slow";
  out.grid = grid;
  out.thinness = thinness;
  each([&](int i, int j, int k) {
    double sum = 0;
    for (int n = 0; n < 27; ++n) {
      const int x = i + n % 3 - 1, y = j + n / 3 % 3 - 1, z = k + n / 9 - 1;
      if (n != 13 && inside(x, y, z)) sum += std::sqrt(distance[grid.offset(x, y, z)]);
    }
    const std::uint32_t own = distance[grid.offset(i, j, k)];
    const double deficit = std::sqrt(own) - sum / 26;
    if (!(deficit > thinness)) return;
    out.voxel.push_back(
        {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), static_cast<std::uint16_t>(k)});
    out.distance.push_back(own);
    out.deficit.push_back(static_cast<float>(deficit));
    out.segment.push_back(0);
  });
  return out;
}

}  // namespace ecorche::test
