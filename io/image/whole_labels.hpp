// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// A label map whose voxels are stored as real numbers, as many programs write them: the same numbers as u8,
/// u16 or i32, the narrowest that holds all. Integers are handed back as they are. Throws Error{data} for
/// values that are not finite, not whole, or do not fit 32 bits.
Image whole_labels(Image image, const std::filesystem::path& path);

}  // namespace ecorche::io
