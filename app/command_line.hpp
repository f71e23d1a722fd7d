// SPDX-License-Identifier: AGPL-3.0-or-later
// The command line's own words: what is unknown and what was meant, and help pages.
#pragma once

#include "app/cli_fwd.hpp"

namespace ecorche::app {

/// Gives `app` and its subcommands their help pages: choices stand once, as `a|b|c`, and each page ends with
/// an example. The examples run as they stand, one after the other (tests/e2e/cli/help_test.py).
void dress_help(CLI::App& app);

/// Parses. Throws CLI::Success for --help and --version, and Error{usage} for what cannot be understood: an
/// unknown subcommand or option comes with the nearest known one.
void parse(CLI::App& app, int argc, char** argv);

}  // namespace ecorche::app
