// SPDX-License-Identifier: Apache-2.0
// What must hold in every volumetric skeleton, so that nothing after a reader has to ask again.
#pragma once

#include <string>

#include <ecorche/values/volumetric_skeleton.hpp>

namespace ecorche {

/// The first of these that does not hold, as one phrase; empty where all do. The grid is isotropic within
/// 1e-6, finite, orthonormal, of 1 to 65535 voxels along each axis; arrays have one entry a voxel or, where
/// they may, none; voxels lie in the grid in ascending memory order; distances are positive and no ball
/// reaches beyond the grid; deficits are finite and above the thinness; parents are rows or none, without a
/// cycle; segments are none or not negative (how many there are, the caller knows). O(voxels).
std::string first_defect(const VolumetricSkeleton& skeleton);

}  // namespace ecorche
