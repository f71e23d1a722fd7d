// SPDX-License-Identifier: Apache-2.0
#include "io/image/non_finite.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

// Calls `f` with the scalars of an image of real voxels.
template <class I, class F>
void with_reals(I& image, F&& f) {
  if (image.type == ScalarType::f32) f(image.template scalars<float>());
  if (image.type == ScalarType::f64) f(image.template scalars<double>());
}

}  // namespace

std::size_t count_non_finite(const Image& image) {
  std::size_t count = 0;
  with_reals(image, [&](auto scalars) {
    for (const auto x : scalars) count += std::isfinite(x) ? 0 : 1;
  });
  return count;
}

void replace_non_finite(Image& image, const std::filesystem::path& path, const files::ReadOptions& options) {
  const std::size_t count = count_non_finite(image);
  if (count == 0) return;
  with_reals(image, [&](auto scalars) {
    using T = typename decltype(scalars)::value_type;
    const std::size_t all = scalars.size();
    if (count == all) fields::refuse(path, "none of its " + std::to_string(all) + " values is finite");
    T least = 0;
    if (image.components == 1) {
      least = std::numeric_limits<T>::infinity();
      for (const T x : scalars) least = std::isfinite(x) ? std::min(least, x) : least;
    }
    for (T& x : scalars) x = std::isfinite(x) ? x : least;
    options.say(path.string() + ": " + std::to_string(count) + " of " + std::to_string(all) +
                " values are NaN or infinite: taken as " + text::number(static_cast<double>(least), 6) +
                (image.components == 1 ? ", the least of the others" : "") +
                " (write other values there if that is not meant)");
  });
}

}  // namespace ecorche::io
