// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"

namespace ecorche::io {

/// What an image's voxels are: `labels` take the nearest voxel's number, `grey` values are interpolated.
enum class VoxelKind : std::uint8_t { labels, grey };

/// The farthest that an axis leans: from a right angle to another one, or from the normal of the two others
/// that stand best on each other; degrees, NaN where one has no direction.
double lean_degrees(const ImageGrid& grid);

/// Resamples an image whose axes lean onto right-angled voxels, and says so; others are left as they are.
/// The two axes that stand best on each other stay (of a slanted stack its slices), the third becomes their
/// normal. No spacing grows and each layer stays in its plane, so values are interpolated within layers only.
/// The new grid holds every voxel; around them stand 0 in labels, the least value in grey images. Throws
/// Error{data} where that takes more than the limits allow.
void make_unsheared(Image& image, VoxelKind kind, const std::filesystem::path& path,
                    const files::ReadOptions& options);

}  // namespace ecorche::io
