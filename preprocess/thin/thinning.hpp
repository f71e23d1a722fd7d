// SPDX-License-Identifier: Apache-2.0
// The skeletal voxels of an object (Gagvani01 3.2).
#pragma once

#include <ecorche/values/context.hpp>
#include <ecorche/values/volumetric_skeleton.hpp>
#include "preprocess/thin/distance.hpp"

namespace ecorche::thin {

/// The thinness parameter. Distances of neighbours differ by less than 2 voxels, so -2 keeps every voxel and
/// 2 keeps none.
inline constexpr double least_thinness = -2, most_thinness = 2;

/// The voxels whose deficit, their distance minus the mean of their 26 neighbours' (not squared, in voxels,
/// 0 in the background), is above `thinness`. Time does not depend on `thinness`: sums over nine rows,
/// then along them, always added in the same order, so that a voxel's deficit has the same bits whatever
/// the threads, the thinness and the rest of the image. `grid` is the mask's; without tree or attachment.
/// Throws Error{usage} for a thinness out of range or NaN, Error{data} for a grid whose spacing differs by
/// more than 1e-6 of itself between axes or which has more than 65535 voxels along one.
VolumetricSkeleton thin(const DistanceMap& map, const ImageGrid& grid, double thinness,
                        const Context& context);

/// What `thin` would give at a `thinness` not below the skeleton's own, from the skeleton alone: equal in
/// every bit. Segments stay with their voxels; the tree, which loses its joints, does not. Throws
/// Error{usage} for a lower thinness. O(skeletal voxels).
VolumetricSkeleton thinner(const VolumetricSkeleton& skeleton, double thinness);

}  // namespace ecorche::thin
