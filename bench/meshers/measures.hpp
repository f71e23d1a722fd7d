// SPDX-License-Identifier: Apache-2.0
// What a mesh of a body is judged by.
#pragma once

#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::bench {

struct Shapes {
  double least_deg = 180, greatest_deg = 0;  ///< of all dihedral angles
  double hundredth_deg = 0;                  ///< a hundredth of the tets have a smaller angle
  double least_ratio = 1, mean_ratio = 0;    ///< 3 inradii over the circumradius: 1 is regular
};
Shapes shapes(const TetMesh& mesh);

/// One surface of the case beside the boundary that the mesh gives it, in voxels.
struct SurfaceFit {
  std::string name;
  double to_mesh_p99 = 0, to_input_p99 = 0;  ///< over what is at least a voxel thick
  double thin_share = 0;                     ///< of its area: thinner than a voxel
  double thin_p99 = 0;                       ///< both ways, over what is thinner
  double volume_error = 0;                   ///< share of the surface's own volume, signed
  bool there = true;                         ///< false: the mesh has no tet of it
};
/// Skin (beside the boundary of all tets), then bones. Points are drawn by area, `samples` a direction.
std::vector<SurfaceFit> fits(const Case& patient, const TetMesh& mesh, double voxel, std::size_t samples);

}  // namespace ecorche::bench
