// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/isotropic.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <type_traits>
#include <vector>

namespace ecorche::thin {
namespace {

// Where a new voxel looks along one axis: between `low` and `high`, `part` of the way.
struct Look {
  std::size_t low, high, nearest;
  double part;
};

std::vector<Look> looks(std::int32_t old_size, double old_mm, std::int32_t size, double edge) {
  std::vector<Look> out(static_cast<std::size_t>(size));
  const double last = old_size - 1;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double at = std::clamp((static_cast<double>(i) + 0.5) * edge / old_mm - 0.5, 0.0, last);
    const double low = std::floor(at);
    out[i] = {static_cast<std::size_t>(low), static_cast<std::size_t>(std::min(low + 1, last)),
              static_cast<std::size_t>(std::floor(at + 0.5)), at - low};
  }
  return out;
}

template <class T>
T rounded(double value) {
  if constexpr (std::is_integral_v<T>) {
    return static_cast<T>(std::floor(value + 0.5));
  } else {
    return static_cast<T>(value);
  }
}

template <class T>
void resample(const Image& from, int component, const std::array<std::vector<Look>, 3>& look,
              Sampling sampling, const Context& context, Image& to) {
  const auto in = from.scalars<T>();
  const auto out = to.scalars<T>();
  const auto step = static_cast<std::size_t>(from.components), first = static_cast<std::size_t>(component);
  const auto nx = static_cast<std::size_t>(from.grid.size[0]),
             ny = static_cast<std::size_t>(from.grid.size[1]);
  const auto value = [&](std::size_t i, std::size_t j, std::size_t k) {
    return in[((k * ny + j) * nx + i) * step + first];
  };
  tbb::parallel_for(std::size_t{0}, look[2].size(), [&](std::size_t k) {
    if (context.stop.stop_requested()) return;
    const Look& z = look[2][k];
    std::size_t at = k * look[1].size() * look[0].size();
    for (const Look& y : look[1]) {
      for (const Look& x : look[0]) {
        if (sampling == Sampling::nearest) {
          out[at++] = value(x.nearest, y.nearest, z.nearest);
          continue;
        }
        const auto row = [&](std::size_t j, std::size_t k2) {
          const auto a = static_cast<double>(value(x.low, j, k2)),
                     b = static_cast<double>(value(x.high, j, k2));
          return x.part == 0 ? a : a + x.part * (b - a);
        };
        const auto plane = [&](std::size_t k2) {
          const double a = row(y.low, k2);
          return y.part == 0 ? a : a + y.part * (row(y.high, k2) - a);
        };
        const double a = plane(z.low);
        out[at++] = rounded<T>(z.part == 0 ? a : a + z.part * (plane(z.high) - a));
      }
    }
  });
  context.check_stop();
}

}  // namespace

bool is_isotropic(const ImageGrid& grid) {
  const auto [least, most] = std::minmax_element(grid.spacing.begin(), grid.spacing.end());
  return *most - *least <= 1e-6 * *most;
}

Image to_isotropic(const Image& image, int component, double edge_mm, Sampling sampling,
                   const Context& context) {
  if (component < 0 || component >= image.components) {
    throw Error(ErrorKind::usage, "--component",
                std::to_string(component) + " of an image with " + std::to_string(image.components) +
                    " component(s) a voxel",
                "they count from 0");
  }
  if (!(edge_mm >= 0) || !std::isfinite(edge_mm))
    throw Error(ErrorKind::usage, "--isotropic", "an edge must be positive",
                "give mm, or 0 for the finest axis");
  ImageGrid grid = image.grid;
  const double edge = edge_mm > 0 ? edge_mm : *std::min_element(grid.spacing.begin(), grid.spacing.end());
  std::array<double, 3> corner{};
  double voxels = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double count = std::max(1.0, std::round(grid.size[a] * grid.spacing[a] / edge));
    voxels *= count;
    if (!(count <= 65535) || !(voxels <= 4294967296.0)) {
      std::ostringstream what;
      what << edge << " mm gives more than 65535 voxels along an axis or 2^32 in all";
      throw Error(ErrorKind::usage, "--isotropic", what.str(), "choose a longer edge");
    }
    grid.size[a] = static_cast<std::int32_t>(count);
    corner[a] = 0.5 * edge / grid.spacing[a] - 0.5;
    grid.spacing[a] = edge;
  }
  grid.origin = image.grid.point(corner[0], corner[1], corner[2]);
  Image out(grid, image.type);
  std::array<std::vector<Look>, 3> look;
  for (std::size_t a = 0; a < 3; ++a)
    look[a] = looks(image.grid.size[a], image.grid.spacing[a], grid.size[a], edge);
  with_scalar_type(image.type, [&](auto zero) {
    resample<decltype(zero)>(image, component, look, sampling, context, out);
  });
  return out;
}

}  // namespace ecorche::thin
