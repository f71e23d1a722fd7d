// SPDX-License-Identifier: Apache-2.0
// Samples of a volume at continuous indices of its own grid: the same sums for every deformer.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include <ecorche/values/image.hpp>

namespace ecorche::runtime {

/// Integers are rounded half away from zero and saturated.
template <class T>
T to_scalar(double value) {
  if constexpr (std::is_integral_v<T>) {
    // Half away from zero, as std::round, but without a call: the value fits once it is clamped.
    const double fits = std::clamp(value, static_cast<double>(std::numeric_limits<T>::min()),
                                   static_cast<double>(std::numeric_limits<T>::max()));
    return static_cast<T>(fits < 0 ? fits - 0.5 : fits + 0.5);
  } else {
    return static_cast<T>(value);
  }
}

/// Calls nobody: `floor` is a function where the processor is not known to have it. What is beyond every
/// image goes to -2, which is beyond too.
inline std::int32_t index_below(double x) {
  if (!(x >= -1e9 && x <= 1e9)) return -2;
  const auto whole = static_cast<std::int32_t>(x);
  return whole > x ? whole - 1 : whole;
}

/// What lies beyond the image is `background`.
template <class T>
struct Sampler {
  const ImageGrid& grid;
  std::span<const T> values;
  std::size_t components;
  double background;

  bool inside(std::int32_t i, std::int32_t j, std::int32_t k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < grid.size[0] && j < grid.size[1] && k < grid.size[2];
  }
  const T* at(std::int32_t i, std::int32_t j, std::int32_t k) const {
    return &values[components * grid.offset(i, j, k)];
  }

  /// Leaves `out` alone beyond the image: it holds the background.
  void nearest(double x, double y, double z, T* out) const {
    const std::int32_t i = index_below(x + 0.5), j = index_below(y + 0.5), k = index_below(z + 0.5);
    if (inside(i, j, k)) std::copy_n(at(i, j, k), components, out);
  }

  void trilinear(double x, double y, double z, T* out) const {
    const std::int32_t i = index_below(x), j = index_below(y), k = index_below(z);
    const auto beyond = [](std::int32_t at, std::int32_t size) { return at < -1 || at >= size; };
    if (beyond(i, grid.size[0]) || beyond(j, grid.size[1]) || beyond(k, grid.size[2])) {
      return void(std::fill_n(out, components, to_scalar<T>(background)));
    }
    const double px = x - i, py = y - j, pz = z - k;
    if (std::is_integral_v<T> && inside(i, j, k) && inside(i + 1, j + 1, k + 1)) {
      return within(at(i, j, k), px, py, pz, out);
    }
    for (std::size_t c = 0; c < components; ++c) {
      double sum = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const int u = corner & 1, v = corner >> 1 & 1, w = corner >> 2;
        const double weight = (u ? px : 1 - px) * (v ? py : 1 - py) * (w ? pz : 1 - pz);
        if (weight == 0) continue;
        sum += weight *
               (inside(i + u, j + v, k + w) ? static_cast<double>(at(i + u, j + v, k + w)[c]) : background);
      }
      out[c] = to_scalar<T>(sum);
    }
  }

 private:
  // All eight corners are there: the same sum in the same order.
  void within(const T* first, double x1, double y1, double z1, T* out) const {
    const std::size_t row = components * static_cast<std::size_t>(grid.size[0]);
    const std::size_t slice = row * static_cast<std::size_t>(grid.size[1]);
    const double x0 = 1 - x1, y0 = 1 - y1, z0 = 1 - z1;
    for (std::size_t c = 0; c < components; ++c) {
      const T *p = first + c, *q = p + slice;
      const auto value = [](const T* sample) { return static_cast<double>(*sample); };
      double sum = x0 * y0 * z0 * value(p) + x1 * y0 * z0 * value(p + components);
      sum += x0 * y1 * z0 * value(p + row);
      sum += x1 * y1 * z0 * value(p + row + components);
      sum += x0 * y0 * z1 * value(q);
      sum += x1 * y0 * z1 * value(q + components);
      sum += x0 * y1 * z1 * value(q + row);
      sum += x1 * y1 * z1 * value(q + row + components);
      out[c] = to_scalar<T>(sum);
    }
  }
};

}  // namespace ecorche::runtime
