// SPDX-License-Identifier: Apache-2.0
// What stands at a path that a user or a foreign file named. The functions of std::filesystem throw where the
// name is longer than a system's may be, or lies behind a folder that may not be read; here such a path names
// nothing, and whoever opens or writes it says what is wrong.
#pragma once

#include <filesystem>
#include <system_error>

namespace ecorche::files {

/// Whether anything is there. Follows links, as do those below.
inline bool is_there(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

/// Whether a folder is there.
inline bool is_folder(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error);
}

/// Whether a file is there that is no folder, socket or device.
inline bool is_file(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

}  // namespace ecorche::files
