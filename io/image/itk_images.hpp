// SPDX-License-Identifier: Apache-2.0
// ITK's image formats behind plain values. The only unit that sees ITK, which brings its own Eigen.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>

namespace ecorche::io::itk_images {

enum class Format { nrrd, meta, nifti };

/// What ITK makes of the header: compared with what we made of it before any voxel is read.
/// No voxels where it has not three axes. Throws Error{data} for what ITK refuses.
Image read_header(const std::filesystem::path& path, Format format);

/// Throws Error{io}.
void write(const std::filesystem::path& path, Format format, const Image& image, bool compress);

}  // namespace ecorche::io::itk_images
