// SPDX-License-Identifier: Apache-2.0
#include "io/image/same_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/values/text.hpp"

namespace ecorche::io {

bool same_place(const ImageGrid& a, const ImageGrid& b) {
  if (a.size != b.size) return false;
  const double most = 0.1 * *std::min_element(a.spacing.begin(), a.spacing.end());
  for (int corner = 0; corner < 8; ++corner) {
    const double i = (corner & 1) != 0 ? a.size[0] : 0, j = (corner & 2) != 0 ? a.size[1] : 0,
                 k = (corner & 4) != 0 ? a.size[2] : 0;
    const auto p = a.point(i, j, k), q = b.point(i, j, k);
    if (!(std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) <= most)) return false;
  }
  return true;
}

std::string described(const ImageGrid& grid) {
  std::string out;
  for (std::size_t a = 0; a < 3; ++a) out += (a ? " x " : "") + std::to_string(grid.size[a]);
  out += " voxels of ";
  for (std::size_t a = 0; a < 3; ++a) out += (a ? " x " : "") + text::number(grid.spacing[a], 6);
  out += " mm from [";
  for (std::size_t a = 0; a < 3; ++a) out += (a ? ", " : "") + text::number(grid.origin[a], 6);
  return out + "]";
}

Image resampled_nearest(const Image& image, const ImageGrid& grid, double beyond) {
  Image out(grid, image.type, image.components);
  if (beyond != 0) {
    with_scalar_type(out.type, [&](auto zero) {
      using T = decltype(zero);
      const auto scalars = out.scalars<T>();
      std::fill(scalars.begin(), scalars.end(), static_cast<T>(beyond));
    });
  }
  // The index is affine in the index: one step along i adds the same to all three.
  const auto origin = image.grid.index(grid.point(0, 0, 0));
  std::array<std::array<double, 3>, 3> step{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto to = image.grid.index(grid.point(a == 0 ? 1 : 0, a == 1 ? 1 : 0, a == 2 ? 1 : 0));
    for (std::size_t c = 0; c < 3; ++c) step[a][c] = to[c] - origin[c];
  }
  const std::size_t size = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        std::array<int, 3> from{};
        bool within = true;
        for (std::size_t c = 0; c < 3; ++c) {
          const double index = origin[c] + step[0][c] * i + step[1][c] * j + step[2][c] * k;
          within = within && index >= -0.5 && index < image.grid.size[c] - 0.5;
          if (within) from[c] = static_cast<int>(std::floor(index + 0.5));
        }
        if (within)
          std::memcpy(out.bytes.data() + at * size,
                      image.bytes.data() + image.grid.offset(from[0], from[1], from[2]) * size, size);
      }
    }
  }
  return out;
}

}  // namespace ecorche::io
