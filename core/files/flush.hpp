// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace ecorche::files {

/// Brings a file, or the names in a folder, to the disk; false where the file system refuses.
bool flush(const std::filesystem::path& path);

}  // namespace ecorche::files
