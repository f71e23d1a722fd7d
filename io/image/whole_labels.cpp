// SPDX-License-Identifier: Apache-2.0
#include "io/image/whole_labels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/non_finite.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

std::string place_of(const Image& image, std::size_t scalar) {
  std::size_t voxel = scalar / static_cast<std::size_t>(image.components);
  std::string out = "voxel (";
  for (std::size_t a = 0; a < 3; ++a) {
    const auto size = static_cast<std::size_t>(image.grid.size[a]);
    out += (a > 0 ? ", " : "") + std::to_string(voxel % size);
    voxel /= size;
  }
  return out + ")";
}

template <class To, class From>
Image narrowed(const Image& image, std::span<const From> from) {
  Image out(image.grid, scalar_type_of<To>, image.components);
  std::transform(from.begin(), from.end(), out.scalars<To>().begin(),
                 [](From x) { return static_cast<To>(x); });
  return out;
}

template <class T>
Image whole(const Image& image, const Path& path) {
  const std::span<const T> values = image.scalars<T>();
  if (const std::size_t bad = count_non_finite(image); bad > 0) {
    refuse(path, std::to_string(bad) + " of " + std::to_string(values.size()) + " labels are NaN or infinite",
           "labels are whole numbers: set those voxels to 0");
  }
  const auto is_whole = [](T x) { return x == std::floor(x); };
  const auto fraction = std::find_if_not(values.begin(), values.end(), is_whole);
  if (fraction != values.end()) {
    const auto at = static_cast<std::size_t>(fraction - values.begin());
    const auto count =
        values.size() - static_cast<std::size_t>(std::count_if(fraction, values.end(), is_whole)) - at;
    refuse(path,
           std::to_string(count) + " of " + std::to_string(values.size()) +
               " labels are no whole numbers, the first " + text::number(static_cast<double>(*fraction), 9) +
               " at " + place_of(image, at),
           "if it was resampled, resample the label map by nearest neighbour");
  }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  // Every i32 is a double, but 2^31 - 1 is no float: the comparison is made in doubles.
  const double low = static_cast<double>(*least), high = static_cast<double>(*most);
  if (low < std::numeric_limits<std::int32_t>::min() || high > std::numeric_limits<std::int32_t>::max()) {
    const auto worst = high > std::numeric_limits<std::int32_t>::max() ? most : least;
    refuse(path,
           "holds the label " + text::number(static_cast<double>(*worst), 9) + " at " +
               place_of(image, static_cast<std::size_t>(worst - values.begin())),
           "labels fit 32 bits: renumber them");
  }
  if (low >= 0 && high <= 255) return narrowed<std::uint8_t>(image, values);
  if (low >= 0 && high <= 65535) return narrowed<std::uint16_t>(image, values);
  return narrowed<std::int32_t>(image, values);
}

}  // namespace

Image whole_labels(Image image, const Path& path) {
  if (image.type == ScalarType::f32) return whole<float>(image, path);
  if (image.type == ScalarType::f64) return whole<double>(image, path);
  return image;
}

}  // namespace ecorche::io
