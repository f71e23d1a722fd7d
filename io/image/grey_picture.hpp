// SPDX-License-Identifier: Apache-2.0
// Flat pictures of 16-bit grey values.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

namespace ecorche::io {

struct GreyPicture {
  std::int32_t width = 0, height = 0;
  std::array<double, 2> pixel_mm{1, 1};  ///< width and height of a pixel
  std::span<const std::uint16_t> grey;   ///< row by row from the top; 0 is black
};

/// Writes it as PNG, atomically, with the size of its pixels. Throws Error{cannot_create, io}.
void write_png(const std::filesystem::path& path, const GreyPicture& picture);

}  // namespace ecorche::io
