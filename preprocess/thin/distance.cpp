// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/distance.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include "preprocess/thin/chamfer.hpp"
#include "preprocess/thin/euclidean.hpp"
#include "preprocess/thin/window_minimum.hpp"

namespace ecorche::thin {
namespace {

// Bytes of a row that one column job takes: small enough that a tall column stays in the second cache.
constexpr std::size_t kRowBytes = 256;
constexpr std::size_t kVectorBytes = 64;

template <class T>
std::size_t padded(std::size_t width) {
  constexpr std::size_t lanes = kVectorBytes / sizeof(T);
  return (width + lanes - 1) / lanes * lanes;
}

// cost[d] of d steps along an axis of n voxels.
template <class T>
std::vector<T> step_costs(std::int32_t n, double spacing) {
  std::vector<T> cost(static_cast<std::size_t>(n) + 2);
  for (std::size_t d = 0; d < cost.size(); ++d) {
    if constexpr (std::is_same_v<T, double>) {
      const double along = spacing * static_cast<double>(d);
      cost[d] = along * along;
    } else {
      const std::uint64_t square = static_cast<std::uint64_t>(d) * d;
      cost[d] = static_cast<T>(std::min<std::uint64_t>(square, std::numeric_limits<T>::max()));
    }
  }
  return cost;
}

// The first axis: runs of the object between two backgrounds count up and down again.
template <class T>
void along_row(const std::uint8_t* inside, std::size_t n, const T* cost, T* out) {
  std::fill_n(out, n, T{0});
  for (std::size_t at = 0; at < n;) {
    std::uint64_t eight = 0;
    while (at + 8 <= n && (std::memcpy(&eight, inside + at, 8), eight == 0)) at += 8;
    while (at < n && inside[at] == 0) ++at;
    if (at == n) return;
    const void* zero = std::memchr(inside + at, 0, n - at);
    const std::size_t end =
        zero == nullptr ? n : static_cast<std::size_t>(static_cast<const std::uint8_t*>(zero) - inside);
    const std::size_t half = (end - at + 1) / 2;
    for (std::size_t t = 0; t < half; ++t) out[at + t] = cost[t + 1];
    for (std::size_t t = 0; t < half; ++t) out[end - 1 - t] = cost[t + 1];
    at = end;
  }
}

template <class T>
Field<T> transform(const Mask& mask, const std::array<double, 3>& spacing, const Context& context) {
  const auto nx = static_cast<std::size_t>(mask.grid.size[0]),
             ny = static_cast<std::size_t>(mask.grid.size[1]),
             nz = static_cast<std::size_t>(mask.grid.size[2]);
  const std::vector<T> cost_x = step_costs<T>(mask.grid.size[0], spacing[0]),
                       cost_y = step_costs<T>(mask.grid.size[1], spacing[1]),
                       cost_z = step_costs<T>(mask.grid.size[2], spacing[2]);
  Field<T> out(nx * ny * nz);
  const auto stopped = [&] { return context.stop.stop_requested(); };

  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, nz), [&](const auto& slices) {
    const std::size_t stride = padded<T>(nx);
    std::vector<T> rows(stride * ny, T{0});  // of one slice; what pads a row stays 0
    for (std::size_t k = slices.begin(); k < slices.end() && !stopped(); ++k) {
      for (std::size_t j = 0; j < ny; ++j)
        along_row(mask.inside.data() + (k * ny + j) * nx, nx, cost_x.data(), rows.data() + j * stride);
      window_minimum(WindowJob<T>{rows.data(), stride, out.data() + k * ny * nx, nx, ny, nx, cost_y.data()});
    }
  });
  context.check_stop();
  context.report(0.5);
  const std::size_t chunk = kRowBytes / sizeof(T);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, ny), [&](const auto& planes) {
    std::vector<T> column(chunk * nz, T{0});
    for (std::size_t j = planes.begin(); j < planes.end() && !stopped(); ++j) {
      for (std::size_t i = 0; i < nx; i += chunk) {
        const std::size_t width = std::min(chunk, nx - i);
        T* const from = out.data() + j * nx + i;
        for (std::size_t k = 0; k < nz; ++k) {
          std::copy_n(from + k * ny * nx, width, column.data() + k * chunk);
          if (width < chunk)
            std::fill(column.begin() + static_cast<std::ptrdiff_t>(k * chunk + width),
                      column.begin() + static_cast<std::ptrdiff_t>((k + 1) * chunk), T{0});
        }
        window_minimum(WindowJob<T>{column.data(), chunk, from, ny * nx, nz, width, cost_z.data()});
      }
    }
  });
  context.check_stop();
  context.report(1);
  return out;
}

}  // namespace

bool holds_all(const Field<std::uint16_t>& squares) {
  return !tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, squares.size(), 1 << 20), false,
      [&](const auto& range, bool found) {
        const auto* begin = squares.data() + range.begin();
        return found || std::find(begin, begin + range.size(), 65535) != begin + range.size();
      },
      std::logical_or<>());
}

template <class T>
Field<T> squared_distance(const Mask& mask, const Context& context) {
  return transform<T>(mask, {1, 1, 1}, context);
}

template Field<std::uint16_t> squared_distance(const Mask&, const Context&);
template Field<std::uint32_t> squared_distance(const Mask&, const Context&);

DistanceMap distance_map(const Mask& mask, DistanceMetric metric, const Context& context) {
  DistanceMap map;
  map.metric = metric;
  map.size = mask.grid.size;
  if (metric == DistanceMetric::chamfer345) {
    Field<std::uint8_t> narrow = chamfer<std::uint8_t>(mask, context);
    if (const auto values = narrow.span(); std::find(values.begin(), values.end(), 255) == values.end()) {
      map.values = std::move(narrow);
    } else {
      map.values = chamfer<std::uint16_t>(mask, context);
    }
    return map;
  }
  // Background beyond the image bounds every distance by half of the thinnest axis.
  const std::int32_t thinnest = *std::min_element(map.size.begin(), map.size.end());
  Field<std::uint16_t> narrow = squared_distance<std::uint16_t>(mask, context);
  if ((thinnest + 1) / 2 < 256 || holds_all(narrow)) {
    map.values = std::move(narrow);
  } else {
    narrow = {};
    map.values = squared_distance<std::uint32_t>(mask, context);
  }
  return map;
}

Field<double> squared_distance_mm(const Mask& mask, const Context& context) {
  return transform<double>(mask, mask.grid.spacing, context);
}

}  // namespace ecorche::thin
