// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::vtk_legacy {

/// A legacy `.vtk` of versions 1 to 5, ASCII or BINARY (big-endian), DATASET POLYDATA: its POLYGONS and
/// TRIANGLE_STRIPS; vertices, lines, data of points and cells and whatever follows are passed over. Throws
/// Error{data}.
SurfaceMesh decode(std::string_view file, const std::string& where, const files::ReadLimits& limits = {});

/// What follows `SPACE=` in the title, its second line.
std::optional<std::string> space_tag(std::string_view file);

}  // namespace ecorche::io::vtk_legacy
