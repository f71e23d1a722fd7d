// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::vtp {

struct Decoded {
  SurfaceMesh mesh;
  std::optional<std::string> space;  ///< of a string array `SPACE` in its field data
};

/// VTK XML PolyData of one or several pieces: polygons and strips, arrays as text, base64 or appended (raw or
/// base64), plain or packed by zlib, either byte order, headers of 32 or 64 bits. Throws Error{data}; lz4 and
/// lzma are refused by name.
Decoded decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

}  // namespace ecorche::io::vtp
