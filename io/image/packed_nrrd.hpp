// SPDX-License-Identifier: Apache-2.0
// Packed NRRDs, by all threads: a CT of hundreds of megabytes takes one thread longer than anything else.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// Writes an image of one component as `.nrrd` with one gzip stream, in pieces that are packed beside each
/// other; the same bytes for any number of threads. Throws Error{io}.
void write_packed_nrrd(const std::filesystem::path& path, const Image& image);

}  // namespace ecorche::io
