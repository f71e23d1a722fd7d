// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_resampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::io::dicom {
namespace {

// One slice on the pixels of the grid; whatever is not between four of its pixels is `outside`.
template <class T>
void shift_slice(std::span<const T> slice, const std::array<std::int32_t, 2>& size,
                 const std::array<double, 2>& shift, const ImageGrid& grid, double outside,
                 std::vector<double>& out) {
  std::array<int, 2> whole{};
  std::array<double, 2> part{};
  for (std::size_t a = 0; a < 2; ++a) {
    const double floor = std::floor(-shift[a]);
    whole[a] = static_cast<int>(floor);
    part[a] = -shift[a] - floor;
    if (part[a] < 1e-9) part[a] = 0;  // else the last row would need one more
  }
  const auto at = [&](int i, int j) {
    return static_cast<double>(
        slice[static_cast<std::size_t>(j) * static_cast<std::size_t>(size[0]) + static_cast<std::size_t>(i)]);
  };
  const int right = part[0] > 0 ? 1 : 0, down = part[1] > 0 ? 1 : 0;
  std::size_t to = 0;
  for (int j = 0; j < grid.size[1]; ++j) {
    for (int i = 0; i < grid.size[0]; ++i, ++to) {
      const int x = i + whole[0], y = j + whole[1];
      if (x < 0 || y < 0 || x + right >= size[0] || y + down >= size[1]) {
        out[to] = outside;
        continue;
      }
      const double above = std::lerp(at(x, y), at(x + right, y), part[0]);
      const double below = std::lerp(at(x, y + down), at(x + right, y + down), part[0]);
      out[to] = std::lerp(above, below, part[1]);
    }
  }
}

template <class T>
T stored(double value) {
  if constexpr (std::is_integral_v<T>) {
    using Limits = std::numeric_limits<T>;  // the padding may lie beyond
    return static_cast<T>(std::clamp(std::floor(value + 0.5), static_cast<double>(Limits::lowest()),
                                     static_cast<double>(Limits::max())));
  } else {
    return static_cast<T>(value);
  }
}

template <class T>
void resample(std::span<const T> from, const std::array<std::int32_t, 2>& size, const PlacedStack& stack,
              std::span<T> to) {
  const std::size_t plane = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
  const std::size_t made =
      static_cast<std::size_t>(stack.grid.size[0]) * static_cast<std::size_t>(stack.grid.size[1]);
  const Slice& first = stack.slices.front();
  const double outside = first.file->padding
                             ? *first.file->padding * first.slope + first.intercept
                             : static_cast<double>(*std::min_element(from.begin(), from.end()));
  std::array<std::vector<double>, 2> slice{std::vector<double>(made), std::vector<double>(made)};
  std::array<std::size_t, 2> held{~std::size_t{0}, ~std::size_t{0}};
  const auto fetch = [&](std::size_t k) -> const std::vector<double>& {
    const std::size_t side = k % 2;
    if (held[side] != k) {
      const std::array<double, 2> shift = stack.shift.empty() ? std::array<double, 2>{} : stack.shift[k];
      shift_slice(from.subspan(k * plane, plane), size, shift, stack.grid, outside, slice[side]);
      held[side] = k;
    }
    return slice[side];
  };
  std::size_t low = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(stack.grid.size[2]); ++k) {
    double part = 0;
    if (stack.at.empty()) {
      low = k;
    } else {
      while (low + 1 < stack.at.size() && stack.at[low + 1] <= static_cast<double>(k)) ++low;
      if (low + 1 < stack.at.size())
        part = (static_cast<double>(k) - stack.at[low]) / (stack.at[low + 1] - stack.at[low]);
    }
    const std::vector<double>& below = fetch(low);
    const std::vector<double>& above = part > 0 ? fetch(low + 1) : below;
    for (std::size_t i = 0; i < made; ++i) to[k * made + i] = stored<T>(std::lerp(below[i], above[i], part));
  }
}

}  // namespace

Image resampled(const Image& slices, const PlacedStack& stack, files::Budget& budget) {
  budget.spend(stack.grid.voxels(), scalar_bytes(slices.type));
  budget.spend(std::uint64_t{2} * static_cast<std::uint64_t>(stack.grid.size[0]) *
                   static_cast<std::uint64_t>(stack.grid.size[1]),
               sizeof(double));
  Image out(stack.grid, slices.type);
  with_scalar_type(slices.type, [&](auto zero) {
    using T = decltype(zero);
    resample<T>(slices.scalars<T>(), {slices.grid.size[0], slices.grid.size[1]}, stack, out.scalars<T>());
  });
  return out;
}

}  // namespace ecorche::io::dicom
