// SPDX-License-Identifier: Apache-2.0
// DICOM series as images (PS3.3 A.3, A.38: CT and MR, in single slices or files of several frames).
#pragma once

#include <filesystem>
#include <vector>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"

namespace ecorche::io {

/// Reads the series in `path`, a folder (with what lies below it) or one file: slices in order of their
/// place, values after Rescale Slope and Intercept (whole numbers stay whole, as narrow as they fit), raw or
/// packed by RLE, JPEG, JPEG-LS or JPEG 2000. A tilted gantry and uneven distances are resampled, copies
/// dropped; each is said. Where `labels`, what would need interpolation is refused. Throws
/// Error{missing_input, io}, and Error{data}: several series or phases of which none is chosen, missing or
/// doubled slices, colours, files that are cut, more memory than the files stand for.
Image read_dicom(const std::filesystem::path& path, const files::ReadOptions& options,
                 const ImageChoice& choice, bool labels = false);

/// The files that `read_dicom` would read: `path` itself, or those of the folder that are DICOM.
std::vector<std::filesystem::path> dicom_files(const std::filesystem::path& path);

/// Whether any of them shows slices of an image, beside segmentations, reports and contours.
bool holds_slices(const std::filesystem::path& path, const files::ReadOptions& options);

}  // namespace ecorche::io
