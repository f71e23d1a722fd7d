// SPDX-License-Identifier: Apache-2.0
// Inside and outside of surfaces that do not close.
#pragma once

#include "core/values/mesh.hpp"
#include "preprocess/voxel/rasterize.hpp"

namespace ecorche::voxel {

/// Marks what is inside an open surface: what a flood from outside cannot reach through untouched voxels
/// falls into parts, and each part asks one generalized winding number (JacobsonKavan13), the mean of three
/// of its voxels: inside from 1/2. A part under 8 voxels is taken as inside unasked. So slits and holes up to
/// a voxel are closed; through wider ones the inside floods away, and only the touched voxels remain. `mask`
/// must have an untouched margin. Returns the number of voxels found inside.
std::size_t mark_inside_open(const SurfaceMesh& surface, const ImageGrid& grid, VoxelMask& mask,
                             const Context& context);

/// The solid angle of the whole surface seen from `p`, over 4 pi: about 1 inside, 0 outside.
double generalized_winding(const SurfaceMesh& surface, const Eigen::Vector3d& p);

}  // namespace ecorche::voxel
