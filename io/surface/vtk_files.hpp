// SPDX-License-Identifier: Apache-2.0
// VTK's writers behind plain values. The only unit that sees VTK.
#pragma once

#include <filesystem>
#include <vector>

#include <ecorche/values/mesh.hpp>
#include "io/surface/surface_file.hpp"
#include "io/surface/tied_surfaces.hpp"

namespace ecorche::io::vtk_files {

/// Binary PLY, float32 points, `SPACE=LPS` as a comment. Throws Error{io} with VTK's message.
void write_ply(const std::filesystem::path& path, const SurfaceMesh& mesh);
/// XML PolyData, raw appended, float32 points. Arrays must have one row per point (Error{internal}).
void write_vtp(const std::filesystem::path& path, const SurfaceMesh& mesh,
               const std::vector<GridArray>& point_data = {});
/// The same with the int32 `tet` and the float32 `share` of every point.
void write_tied(const std::filesystem::path& path, const TiedSurfaces& surfaces);
/// XML UnstructuredGrid, raw appended, float32 points. Arrays must have one row per point or tet
/// (Error{internal}).
void write_vtu(const std::filesystem::path& path, const PointsF& V, const Tets& T,
               const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data);

}  // namespace ecorche::io::vtk_files
