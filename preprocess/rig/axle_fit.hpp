// SPDX-License-Identifier: Apache-2.0
// The axle of a joint's surface that nobody marked: condyles, the spool of a trochlea, the drum of a talus.
#pragma once

#include "preprocess/rig/cylinder_fit.hpp"
#include "preprocess/rig/surface_points.hpp"

namespace ecorche::rig {

/// A cylinder whose radius may change along it, through those of the points whose normals point away from its
/// axis: the two condyles of a knee differ in radius, a trochlea is waisted, a talus a cone, and all turn
/// about the axis of that surface. Cylinders through two points with normals along 600 directions judged by
/// truncated squares weighted by area (robust.hpp; draws from a fixed seed), the best few refined by least
/// squares, then the radius at eight places along the axis with them, held together by a small penalty.
/// `radius` is their mean; `inlier_share` the share, by area, of the points with radial normals;
/// `residual` the rms distance of the inliers. Nothing when there are fewer than twelve points or they lie on
/// no such surface.
std::optional<CylinderFit> fit_axle(const SurfacePoints& points);

}  // namespace ecorche::rig
