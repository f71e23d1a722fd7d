// SPDX-License-Identifier: Apache-2.0
// STL as bytes. Both forms of the format repeat every corner of every triangle.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::stl {

/// A binary or text STL, told by content: a binary one may begin with "solid", so the size decides first
/// (84 + 50 n bytes). Corners with equal coordinates become one vertex, in order of first use (-0 counts as
/// 0). `where` names the file in messages. Throws Error{data}.
SurfaceMesh decode(std::string_view bytes, const std::string& where, const files::ReadLimits& limits = {});

/// A binary STL, `SPACE=LPS` in its header, coordinates narrowed to float32.
/// Throws Error{internal} for a triangle without vertex, or a mesh that the format cannot count.
std::string encode(const SurfaceMesh& mesh);

/// What follows `SPACE=` in the header or the first line, as some tools write it.
std::optional<std::string> space_tag(std::string_view bytes);

}  // namespace ecorche::io::stl
