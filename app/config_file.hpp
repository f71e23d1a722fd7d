// SPDX-License-Identifier: Apache-2.0
// Options of a command from a file, by the very definitions that read them from the command line.
#pragma once

#include <string>

#include "app/cli_fwd.hpp"

namespace ecorche::app {

/// Gives the command's options what the YAML file at `path` says, once the command line is read. A key is an
/// option's long name with `_` for `-` (`max_connections: 64`), or `threads`; its value is a scalar or, for
/// an option that may be repeated, a list. A flag takes `true` and `false`. What the command line says of an
/// option, or of one that excludes it, goes before the file.
///
/// Throws Error{config} that names file, line and key for an unknown key, a value that the option refuses and
/// two keys that exclude each other, and what reading throws.
void take_config(CLI::App& command, const std::string& path);

}  // namespace ecorche::app
