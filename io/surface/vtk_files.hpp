// SPDX-License-Identifier: Apache-2.0
// VTK's writers behind plain values. The only unit that sees VTK.
#pragma once

#include <filesystem>
#include <vector>

#include "core/values/mesh.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::io::vtk_files {

/// Binary PLY, float32 points, `SPACE=LPS` as a comment. Throws Error{io} with VTK's message.
void write_ply(const std::filesystem::path& path, const SurfaceMesh& mesh);
/// XML PolyData, raw appended, float32 points.
void write_vtp(const std::filesystem::path& path, const SurfaceMesh& mesh);
/// XML UnstructuredGrid, raw appended, float32 points. Arrays must have one row per point or tet
/// (Error{internal}).
void write_vtu(const std::filesystem::path& path, const PointsF& V, const Tets& T,
               const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data);

}  // namespace ecorche::io::vtk_files
