// SPDX-License-Identifier: Apache-2.0
// Images as files and DICOM folders, LPS mm; read and written by ITK behind plain values.
#pragma once

#include <filesystem>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io {

/// Reads `.nrrd`, `.mha` (raw or gzip), their detached forms `.nhdr`, `.mhd`, whose voxels must lie in one
/// file beside them, and NIfTI-1 (`.nii`, `.nii.gz`; stored integers with a scale become float): 3-D, scalar
/// type and direction kept whole (also a left-handed one), one or several components; integers of 64 bits
/// become i32; of several volumes in time (the fourth axis of NIfTI, `.mha` and NRRD, or a NRRD's first axis
/// of kind time or list) the one that `choice.phase` names; and DICOM, a folder or a file (dicom_image.hpp).
/// Before any voxel is allocated the size that the header declares is held against 2^33 bytes, the budget,
/// and the file's own size (raw) or what its stream inflates to (gzip). Axes a little off right angles are
/// mended (right_angles.hpp), those farther off resampled, grey values linearly (unsheared.hpp), values that
/// are not finite replaced (non_finite.hpp); all of it is said. Throws Error{missing_input} or Error{data}.
Image read_image(const std::filesystem::path& path, const files::ReadOptions& options = {},
                 const ImageChoice& choice = {});

/// The same for labels: real voxels that hold whole numbers become integers (whole_labels.hpp), and
/// sheared ones take the nearest. Throws Error{data} for those that do not.
Image read_label_image(const std::filesystem::path& path, const files::ReadOptions& options = {},
                       const ImageChoice& choice = {});

/// The same as the file has it, for those who look first whether it holds grey values or labels: nothing is
/// replaced yet, and sheared axes are as they are. Of what is no DICOM. `in_time`: whether it holds several
/// volumes, of which `phase` is taken; any other image is read as it is.
Image read_stored_image(const std::filesystem::path& path, const files::ReadOptions& options, int phase,
                        bool& in_time);

/// Writes `.nrrd`, `.mha` or `.nii.gz`, atomically; compressed where `compress`.
/// Throws Error{usage} for another extension, Error{cannot_create}, Error{io}.
void write_image(const std::filesystem::path& path, const Image& image, bool compress = true);

}  // namespace ecorche::io
