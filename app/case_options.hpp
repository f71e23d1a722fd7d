// SPDX-License-Identifier: Apache-2.0
// What every subcommand that reads a case lets its user say about it.
#pragma once

#include <ecorche/io/case_file.hpp>
#include "app/cli.hpp"
#include "app/read_budget.hpp"

namespace ecorche::app {

/// `--data`, `--frame` and `--read-budget`. `options` must outlive the command line's parsing.
inline void add_case_options(CLI::App& command, io::CaseOptions& options) {
  command.add_option("--data", options.data, "the folder that `root: data` paths of the case are in");
  command.add_option("--frame", options.frame,
                     "the case's frame, instead of what it says: LPS, RAS, LSA, ...");
  add_read_budget(command, options.limits);
}

}  // namespace ecorche::app
