// SPDX-License-Identifier: Apache-2.0
// Volumetric skeletons by the definition: every pair of voxels is looked at. For masks of a few thousand
// voxels.
#pragma once

#include <functional>

#include <ecorche/values/image.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche::test {

/// u8 image of the voxels where `inside` holds.
Image mask_where(const ImageGrid& grid, const std::function<bool(int i, int j, int k)>& inside);

/// Squared Euclidean distance of every voxel to the nearest zero of a u8 mask (what lies around the grid
/// counts as zero), and the skeletal voxels at `thinness`: those whose deficit is above it; with `thinness`
/// below -1000 every object voxel. No tree; every voxel on segment 0.
VolumetricSkeleton slow_skeleton(const Image& mask, double thinness);

}  // namespace ecorche::test
