// SPDX-License-Identifier: Apache-2.0
// Vertices of a bone with what its surface says of them.
#pragma once

#include <vector>

#include <ecorche/values/mesh.hpp>

namespace ecorche::rig {

struct SurfacePoints {
  Points at = Points(0, 3);      ///< #P by 3, LPS mm
  Points normal = Points(0, 3);  ///< #P by 3, unit, outward; zero where the vertex has no triangle
  std::vector<double> area;      ///< #P, mm^2: a third of the triangles round it
  /// The axis of a cylinder through them is within 60 degrees of this; zero: any.
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  /// Found by proximity, not marked by hand: other parts of the bone may be among them.
  bool found = false;
  bool right = false;  ///< of bones of the right side
};

/// The rows of V, with normals weighted by area.
SurfacePoints surface_points(const SurfaceMesh& mesh, const std::vector<Eigen::Index>& rows);

}  // namespace ecorche::rig
