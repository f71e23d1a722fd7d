// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace ecorche::io {

/// Whether `path` is a DICOM file (its magic, or its ending), or a folder with one among its first files and
/// those of the folders within.
bool is_dicom(const std::filesystem::path& path);

}  // namespace ecorche::io
