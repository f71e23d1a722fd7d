// SPDX-License-Identifier: Apache-2.0
// Small pictures, drawn without any graphics library, for pages that carry them inside.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace ecorche::app::report {

using Colour = std::array<std::uint8_t, 3>;  ///< sRGB

/// `a` with a share of `b`, 0 to 1.
Colour mixed(const Colour& a, const Colour& b, double share);

/// A colour for the i-th of many things: hues a golden angle apart, so that neighbours in number differ.
Colour colour_of(std::size_t i);

/// `#rrggbb`.
std::string css(const Colour& colour);

struct Picture {
  int width = 0, height = 0;
  std::vector<Colour> pixels;  ///< row by row from the top

  Picture(int width_, int height_, const Colour& ground)
      : width(width_),
        height(height_),
        pixels(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), ground) {}
  bool holds(int x, int y) const { return x >= 0 && x < width && y >= 0 && y < height; }
  Colour& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  const Colour& at(int x, int y) const { return const_cast<Picture*>(this)->at(x, y); }

  /// A ring of `thickness` pixels about a point, clipped.
  void ring(double x, double y, double radius, double thickness, const Colour& colour);
};

/// The picture as the bytes of a PNG. Throws Error{internal} where libpng fails.
std::string png_bytes(const Picture& picture);

/// The bytes of a PNG as `data:image/png;base64,...`.
std::string data_uri(const std::string& png);

/// The picture as `data:image/png;base64,...`. Throws Error{internal} where libpng fails.
std::string data_uri(const Picture& picture);

}  // namespace ecorche::app::report
