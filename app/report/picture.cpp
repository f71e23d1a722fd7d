// SPDX-License-Identifier: Apache-2.0
#include "app/report/picture.hpp"

#include <openssl/evp.h>
#include <png.h>

#include <cmath>
#include <cstdio>

#include <ecorche/values/error.hpp>

namespace ecorche::app::report {

Colour mixed(const Colour& a, const Colour& b, double share) {
  Colour out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::lround(a[c] + (b[c] - a[c]) * share));
  return out;
}

Colour colour_of(std::size_t i) {
  // HSL with a lightness that alternates a little, so that also hues that come near are told apart.
  const double hue = std::fmod(0.58 + 0.618033988749895 * static_cast<double>(i), 1.0) * 6;
  const double light = i % 2 == 0 ? 0.55 : 0.45, chroma = 0.6 * (1 - std::abs(2 * light - 1));
  const double x = chroma * (1 - std::abs(std::fmod(hue, 2) - 1)), low = light - chroma / 2;
  const std::array<std::array<double, 3>, 6> sector{
      {{chroma, x, 0}, {x, chroma, 0}, {0, chroma, x}, {0, x, chroma}, {x, 0, chroma}, {chroma, 0, x}}};
  Colour out{};
  for (std::size_t c = 0; c < 3; ++c)
    out[c] =
        static_cast<std::uint8_t>(std::lround(255 * (sector[static_cast<std::size_t>(hue) % 6][c] + low)));
  return out;
}

std::string css(const Colour& colour) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", colour[0], colour[1], colour[2]);
  return text;
}

void Picture::ring(double x, double y, double radius, double thickness, const Colour& colour) {
  const double reach = radius + thickness;
  const auto first = [&](double centre) { return static_cast<int>(std::floor(centre - reach)); };
  const auto last = [&](double centre) { return static_cast<int>(std::ceil(centre + reach)); };
  for (int row = first(y); row <= last(y); ++row) {
    for (int column = first(x); column <= last(x); ++column) {
      if (!holds(column, row)) continue;
      // One pixel of soft edge on either side.
      const double off = std::abs(std::hypot(column - x, row - y) - radius) - thickness / 2;
      if (off < 0.5) at(column, row) = mixed(at(column, row), colour, off < -0.5 ? 1 : 0.5 - off);
    }
  }
}

std::string png_bytes(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  std::string png(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = png.size();
  if (png_image_write_to_memory(&image, png.data(), &size, 0, picture.pixels.data(), 0, nullptr) == 0)
    throw Error(ErrorKind::internal, "report",
                std::string("libpng cannot write the picture: ") + image.message, "report this");
  png.resize(size);
  return png;
}

std::string data_uri(const Picture& picture) {
  return data_uri(png_bytes(picture));
}

std::string data_uri(const std::string& png) {
  std::string base64(4 * ((png.size() + 2) / 3) + 1, '\0');
  const int length =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(base64.data()),
                      reinterpret_cast<const unsigned char*>(png.data()), static_cast<int>(png.size()));
  base64.resize(static_cast<std::size_t>(length));
  return "data:image/png;base64," + base64;
}

}  // namespace ecorche::app::report
