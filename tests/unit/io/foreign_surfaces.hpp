// SPDX-License-Identifier: Apache-2.0
// Foreign writers of surfaces, and a second foreign reader: files that nobody here made.
#pragma once

#include <filesystem>
#include <string>

#include <ecorche/values/mesh.hpp>

namespace ecorche::foreign {

/// Writes `.ply` (`text`, `little`, `big`), `.vtk` (`text`, `binary`, and `text4`, `binary4` of format
/// version 4.2),
/// `.vtp` (`text`, `inline`, `raw`, `base64`, `zlib`, `zlib64`: base64 of zlib with 64-bit headers, `big`:
/// raw in the other byte order, `lz4`) or `.obj` by VTK; a `strips` before the form turns triangles into
/// strips first.
void vtk_write(const std::filesystem::path& path, const SurfaceMesh& mesh, const std::string& form);

/// All meshes of a file, node transforms applied, polygons cut, as assimp reads them: a soup.
SurfaceMesh assimp_surface(const std::filesystem::path& path);

/// Writes `mesh` by assimp: `glb2`, `gltf2`, `obj`, `ply`, `plyb`, ...
void assimp_write(const std::filesystem::path& path, const SurfaceMesh& mesh, const std::string& format);

}  // namespace ecorche::foreign
