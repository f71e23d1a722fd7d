// SPDX-License-Identifier: Apache-2.0
// How far every voxel of a block is from the nearest of some, and which that is.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <ecorche/values/context.hpp>

namespace ecorche::label_surfaces {

inline constexpr float kFar = std::numeric_limits<float>::infinity();

/// `squared` holds 0 at the voxels that are asked for and kFar elsewhere; it becomes the squared distance,
/// mm^2, of every voxel's centre to the nearest of them. `tag`, where it is not empty, holds a number at each
/// of them, which spreads to all that are nearest to it. Both run i fastest over `size` voxels, `spacing` mm
/// apart. Exact but for rounding (SaitoToriwaki94); the same for any number of threads. O(voxels). Throws
/// Error{interrupted}.
void spread_nearest(std::vector<float>& squared, std::vector<std::int32_t>& tag,
                    const std::array<std::int32_t, 3>& size, const std::array<double, 3>& spacing,
                    const Context& context);

}  // namespace ecorche::label_surfaces
