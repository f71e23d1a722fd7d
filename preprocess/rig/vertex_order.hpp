// SPDX-License-Identifier: Apache-2.0
// What is drawn from a bone's vertices, or thinned, goes by where they lie, not by how a file lists them.
#pragma once

#include <string>

#include "preprocess/rig/surface_points.hpp"

namespace ecorche::rig {

/// The same surface, its vertices in an order that their places alone say: a body that is moved, listed
/// otherwise, or mirrored (its sides' names exchanged) has the same one. Bones of segments `NAME_right` are
/// ordered as the mirror images of those of the left side are, and bones amid the body from both sides alike:
/// only there do two vertices that are each other's mirror image stay as they are listed. Triangles keep
/// their order.
SurfaceMesh by_place(const SurfaceMesh& mesh, const std::string& segment);

/// The vertices as the left side has them: the mirror image of a right bone's, all others as they are. Fits
/// that start along directions of space find the mirrored shape in the mirrored body so.
SurfacePoints as_left(const SurfacePoints& points);

/// A fit (a sphere, a cylinder, a plane, an ellipse) to as_left(points), on the side where they lie.
template <class Fit>
Fit from_left(Fit fit, const SurfacePoints& points) {
  if (!points.right) return fit;
  fit.center.x() = -fit.center.x();
  if constexpr (requires { fit.axis; }) fit.axis.x() = -fit.axis.x();
  if constexpr (requires { fit.normal; }) fit.normal.x() = -fit.normal.x();
  if constexpr (requires { fit.major; }) fit.major.x() = -fit.major.x();
  return fit;
}

}  // namespace ecorche::rig
