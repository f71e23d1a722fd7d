// SPDX-License-Identifier: Apache-2.0
// Surfaces and tet grids as files, LPS mm in memory; the format is chosen by the extension.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io {

/// Reads `.stl`, `.obj`, `.ply`, `.off`, `.vtp`, `.vtk` (legacy PolyData), `.gltf` and `.glb`: all triangles
/// of a file as one surface, polygons and strips cut into triangles. The extension says the format, and
/// content that contradicts it is refused. Bit-identical vertices are merged and unused ones left out, the
/// order kept (of first use in STL, of the file elsewhere); triangles with two equal corners are kept.
/// Nothing is moved or scaled. Throws Error{missing_input} or Error{data}: not the format its name says,
/// shorter than its counts, no triangle, a coordinate that is not finite, more memory than `limits` allow a
/// file of its size.
SurfaceMesh read_surface(const std::filesystem::path& path, const files::ReadLimits& limits = {});

/// A surface, and what its file says of its own frame.
struct TaggedSurface {
  SurfaceMesh mesh;
  std::optional<std::string> space;  ///< `SPACE=RAS` in a header, comment or title; or the format's own axes
  /// The millimetres of a unit where the format fixes unit and axes (glTF: 1000, with LSA as `space`).
  std::optional<double> unit_mm;
};
TaggedSurface read_tagged_surface(const std::filesystem::path& path, const files::ReadLimits& limits = {});

/// A surface with what files that hold several say of each.
struct NamedSurface {
  std::string name;
  Group group = Group::other;  ///< chooses the material
  SurfaceMesh mesh;            ///< LPS mm
};

/// Writes a `.glb` of all of them, each a named mesh with its tissue's material, as `write_surface` does of
/// one. Throws Error{usage} for another extension, Error{cannot_create}, Error{io}.
void write_surfaces(const std::filesystem::path& path, std::span<const NamedSurface> surfaces);

/// One array over the points or tets of a VTK file.
struct GridArray {
  std::string name;
  int components = 1;
  std::vector<float> values;
};

/// Writes `.stl` (binary), `.obj`, `.ply` (binary), `.off`, `.vtp`, `.glb`; atomically, coordinates as
/// float32. `.stl`, `.obj`, `.ply` and `.off` carry `SPACE=LPS` in their header; `.glb` is in metres, turned
/// to glTF's frame (x left, y superior, z anterior). `point_data`: a row a vertex, kept by `.vtp` alone.
/// Throws Error{usage} for another extension, Error{cannot_create}, Error{io}.
void write_surface(const std::filesystem::path& path, const SurfaceMesh& mesh,
                   const std::vector<GridArray>& point_data = {});

/// Whether `write_surface` knows the format that the name ends in.
bool writes_surface(const std::filesystem::path& path);

/// Tets out of a file, with what it holds of each node and of each tet. Nothing is said of the tets' volumes:
/// posed ones may be inverted.
struct TetFile {
  PointsF V;
  Tets T;
  std::vector<GridArray> point_data, cell_data;
};

/// Reads tets as `write_tets` writes `.vtu` (or VTK: text, base64 or appended, plain or zlib). Throws
/// Error{missing_input} or Error{data}: another format, a cell that is no tet, values that are not there or
/// not finite.
TetFile read_tets(const std::filesystem::path& path, const files::ReadLimits& limits = {});

/// What each tet is in.
struct TetRegions {
  std::vector<std::uint16_t> label;  ///< one a tet, or none: then all are `body`
  std::vector<std::string> names;    ///< by label
};

/// Writes tets (LPS mm, positive) in the format that the name ends in, atomically: `.vtu` with its arrays
/// (regions are among them, as the caller names them); `.msh` (Gmsh 2.2, binary), `.ele` with its `.node`
/// beside it (TetGen), `.inp` (Abaqus) and `.mcnp.inp` (MCNP6's unstructured mesh, cm) with their regions.
/// `.mcnp.inp` refuses degenerate tets by Error{refused}, see tet_formats.hpp. Throws Error{usage} for
/// another ending, Error{cannot_create}, Error{io}.
void write_tets(const std::filesystem::path& path, const PointsF& V, const Tets& T,
                const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data,
                const TetRegions& regions = {});

}  // namespace ecorche::io
