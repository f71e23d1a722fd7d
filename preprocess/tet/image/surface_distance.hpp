// SPDX-License-Identifier: Apache-2.0
// How far every voxel is from the nearest boundary between labels.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::tet {

/// Thirds of a voxel, by the 3-4-5 chamfer mask (Borgefors96; at most 6 % off), saturated at 255: 85 voxels.
/// A voxel at a boundary is 2. For sizing fields, which ask for no more.
std::vector<std::uint8_t> surface_distance(const Image& labels, const Context& context);

}  // namespace ecorche::tet
