// SPDX-License-Identifier: Apache-2.0
// Foreign readers as plain values: the outside view of what we write.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::foreign {

/// What VTK's reader of `.stl`, `.ply` or `.vtp` makes of a file.
SurfaceMesh vtk_surface(const std::filesystem::path& path);

struct Grid {
  PointsF V;
  Tets T;
  std::map<std::string, std::vector<float>> point_data, cell_data;
};
Grid vtk_tets(const std::filesystem::path& path);

/// What tinygltf makes of the first primitive of a `.glb`.
struct Glb {
  PointsF positions, normals;
  Triangles F;
  std::vector<double> lowest, highest;
};
Glb gltf_surface(const std::filesystem::path& path);

}  // namespace ecorche::foreign
