// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::obj {

/// The polygons of a Wavefront OBJ: `v` and `f` with corners `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from
/// 1 or, negative, backwards from the last vertex so far. All its objects and groups make one surface;
/// normals, textures, colours, points and lines are passed over, curves and free-form surfaces refused.
/// Throws Error{data}.
SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

/// `# SPACE=LPS`, then `v` and `f` lines; coordinates narrowed to float32.
std::string encode(const SurfaceMesh& mesh);

/// What follows `SPACE=` in a comment before the first vertex.
std::optional<std::string> space_tag(std::string_view file);

}  // namespace ecorche::io::obj
