// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::off {

/// The text OFF of Geomview: `OFF`, also with normals, colours or texture coordinates (`STCNOFF`), which are
/// passed over as colours of faces are: coordinates and corners may wrap over lines, and what stands behind
/// the last of them on its line is not read. `4OFF`, `nOFF` and `BINARY` are refused. Throws Error{data}.
SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

/// `OFF`, `# SPACE=LPS`, counts, vertices, faces; coordinates narrowed to float32.
std::string encode(const SurfaceMesh& mesh);

/// What follows `SPACE=` in a comment.
std::optional<std::string> space_tag(std::string_view file);

}  // namespace ecorche::io::off
