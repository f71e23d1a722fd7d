// SPDX-License-Identifier: Apache-2.0
// The part of a bone that faces another: the joint's surface when nobody marked it.
#pragma once

#include "preprocess/rig/surface_points.hpp"

namespace ecorche::rig {

/// Vertices of `bone` within reach of `other`, on the side that looks at it. The reach adapts to the gap:
/// twice the distance of the nearest 2 % of the vertices (16 at least), and never less than the mean edge, so
/// that neither the width of the cartilage nor the resolution must be known. A vertex looks at `other` when
/// its normal is within 60 degrees of the way to the closest point there; where fewer than 16 do, as in bones
/// that touch, reach alone counts. `looks`: a direction within 60 degrees of which the normals must be; zero
/// for any.
SurfacePoints facing_points(const SurfaceMesh& bone, const SurfaceMesh& other,
                            const Eigen::Vector3d& looks = Eigen::Vector3d::Zero());

inline Points facing_vertices(const SurfaceMesh& bone, const SurfaceMesh& other,
                              const Eigen::Vector3d& looks = Eigen::Vector3d::Zero()) {
  return facing_points(bone, other, looks).at;
}

}  // namespace ecorche::rig
