// SPDX-License-Identifier: Apache-2.0
// The union of balls on the grid: what a skeleton would refill, without refilling.
#pragma once

#include <ecorche/values/context.hpp>
#include "runtime/spheres/owners.hpp"

namespace ecorche::runtime {

/// Voxels of the box that some ball holds. The reconstruction loss of a skeleton is what its object has more.
std::size_t covered_voxels(const BallSet& set, const LatticeBox& box, const Context& context = {});

/// 1 where some ball holds the voxel, else 0: u8.
Image covered(const BallSet& set, const LatticeBox& box, const Context& context = {});

/// How far apart two voxels may lie and hang together: corner to corner, or with one empty voxel between.
enum class Gap { none, one_voxel };

/// Pieces of the nonzero voxels of a u8 image that hang together, of at least `least` voxels. O(voxels).
std::size_t parts_of(const Image& mask, std::size_t least, Gap across = Gap::none);

}  // namespace ecorche::runtime
