// SPDX-License-Identifier: Apache-2.0
// CLI11, and what help calls a path.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

// What help calls a file or a folder.
template <>
constexpr const char* CLI::detail::type_name<std::filesystem::path>() {
  return "PATH";
}
