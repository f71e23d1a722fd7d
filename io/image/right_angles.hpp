// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"

namespace ecorche::io {

/// How far the axes of `grid` are off right angles, degrees; NaN where one has no direction.
double degrees_off(const ImageGrid& grid);

/// Makes the axes orthonormal, since everybody inverts them by transposing: what headers round is mended in
/// silence, up to 0.1 degrees by turning every axis by half of it about the image's middle, which is said
/// with the millimetres that it moves its farthest voxel. Axes farther off stay as they are, for
/// make_unsheared to resample; beyond 45 degrees it throws Error{data}.
void make_right_angled(ImageGrid& grid, const std::filesystem::path& path, const files::ReadOptions& options);

}  // namespace ecorche::io
