// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::ply {

/// A PLY 1.0: text, or binary of either byte order. Reads `x y z` of element `vertex`, the list
/// `vertex_indices` (or `vertex_index`) of `face`, and that of `tristrips` (-1 begins a new strip); every
/// other element and property is skipped. Throws Error{data}.
SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

/// What follows `SPACE=` in a comment of the header.
std::optional<std::string> space_tag(std::string_view file);

}  // namespace ecorche::io::ply
