// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"

namespace ecorche::io {

/// Scalars that are NaN or infinite. O(voxels).
std::size_t count_non_finite(const Image& image);

/// Makes every scalar finite, and says how many were not: in an image of one component they become its least
/// value (what scanners write outside their field of view), in one of several 0, no displacement. Throws
/// Error{data} where none is finite.
void replace_non_finite(Image& image, const std::filesystem::path& path, const files::ReadOptions& options);

}  // namespace ecorche::io
