// SPDX-License-Identifier: Apache-2.0
// How large the holes of a surface are, as `ecorche repair --holes` counts.
#pragma once

#include <span>

#include <ecorche/values/mesh.hpp>
#include "core/geometry/surface_edges.hpp"

namespace ecorche::geometry {

/// The edge, mm, of a square as large as triangles that fill the loop: the least of all fans from one of its
/// vertices, of 64 of them at most, so that nothing that fills it by the least area is larger. 0 for a chain
/// that does not close. O(#loop).
double filling_edge(const Points& V, const BoundaryLoop& loop);

/// The hole with the largest filling.
struct LargestHole {
  std::size_t holes = 0;                             ///< of the surface
  std::size_t edges = 0;                             ///< of the largest
  double filling_edge = 0;                           ///< mm
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< mean of its vertices
  bool closed = false;                               ///< all chains of open edges close
};
LargestHole largest_hole(const SurfaceMesh& surface);

}  // namespace ecorche::geometry
