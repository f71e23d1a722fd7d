// SPDX-License-Identifier: Apache-2.0
// The voxels of one surface: those it touches and those inside it, exactly.
#pragma once

#include <ecorche/values/context.hpp>
#include "preprocess/voxel/voxel_mask.hpp"

namespace ecorche::voxel {

/// Voxels that the surface touches, over its own box grown by `margin` voxels, which must lie in the grid.
/// With `inside`, also the voxels whose centre has a non-zero winding number, from signed crossings along
/// columns in x: the surface must be closed. Overlapping shells count once, an inner shell turned inwards is
/// a cavity, a surface turned inside out counts as well. Parallel over triangles; the same bytes for any
/// number of threads.
VoxelMask rasterize(const SnappedSurface& surface, bool inside, int margin, const Context& context);

}  // namespace ecorche::voxel
