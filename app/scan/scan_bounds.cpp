// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_bounds.hpp"

#include "core/values/text.hpp"

namespace ecorche::app {

std::string Bounds::in_words() const {
  const auto corner = [](const std::array<double, 3>& p) {
    return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
  };
  return empty() ? "nowhere" : "from " + corner(low) + " to " + corner(high) + " mm";
}

Bounds bounds_above(const Image& image, double least) {
  return with_scalar_type(image.type, [&](auto zero) {
    const auto values = image.scalars<decltype(zero)>();
    return bounds_where(image.grid, [&](std::size_t v) { return static_cast<double>(values[v]) > least; });
  });
}

}  // namespace ecorche::app
