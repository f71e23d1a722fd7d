// SPDX-License-Identifier: Apache-2.0
// Packed NRRDs, by all threads.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// Writes an image as `.nrrd` with one gzip stream; the same bytes for any number of threads. Throws
/// Error{io}.
void write_packed_nrrd(const std::filesystem::path& path, const Image& image);

}  // namespace ecorche::io
