// SPDX-License-Identifier: Apache-2.0
// Whether images lie voxel on voxel, and how they come to.
#pragma once

#include <string>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// As many voxels, and no corner farther off than a tenth of a voxel: headers round.
bool same_place(const ImageGrid& a, const ImageGrid& b);

/// `128 x 128 x 60 voxels of 3 x 3 x 5 mm from [0, 0, 0]`, for messages.
std::string described(const ImageGrid& grid);

/// The value at the nearest voxel of `image` for every voxel of `grid`; `beyond` where it has none.
Image resampled_nearest(const Image& image, const ImageGrid& grid, double beyond = 0);

}  // namespace ecorche::io
