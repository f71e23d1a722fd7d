// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace ecorche::io {

/// Whether `path` is a DICOM file (its magic, or its ending), or a folder among whose first files is one.
bool is_dicom(const std::filesystem::path& path);

/// Throws Error{data} where `path`, which a user gave for an image, is DICOM or a folder: says what it is and
/// how it becomes one file.
void refuse_dicom(const std::filesystem::path& path);

}  // namespace ecorche::io
