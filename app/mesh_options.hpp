// SPDX-License-Identifier: Apache-2.0
// How finely a body is prepared, for every subcommand that prepares one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <ecorche/preprocess/pipeline.hpp>
#include "app/cli_fwd.hpp"

namespace ecorche::app {

/// `--mesher`, `--voxel`, `--max-tets`, `--max-nodes`. `options` must outlive the command line's parsing.
std::vector<CLI::Option*> add_mesh_options(CLI::App& command, preprocess::Options& options);

/// For CLI11, which keeps its own.
inline std::vector<std::string> owned(const std::vector<std::string_view>& names) {
  return {names.begin(), names.end()};
}

}  // namespace ecorche::app
