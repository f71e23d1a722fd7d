// SPDX-License-Identifier: Apache-2.0
// Packed NIfTIs, by all threads.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>

namespace ecorche::io {

/// Writes an image of three axes, none of a single voxel, as `.nii.gz` with one gzip stream: what ITK writes,
/// byte for byte once it is unpacked. The same bytes for any number of threads. Throws Error{io}.
void write_packed_nifti(const std::filesystem::path& path, const Image& image);

}  // namespace ecorche::io
