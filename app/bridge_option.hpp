// SPDX-License-Identifier: Apache-2.0
// `--bridge`, which every command that poses balls has, and `--no-bridge`.
#pragma once

#include "app/cli.hpp"

namespace ecorche::app {

/// `bridge` keeps what it holds where neither is given. Nothing is added where nothing turns.
inline void add_bridge_option(CLI::App& command, bool& bridge) {
  command.add_flag("--bridge,!--no-bridge", bridge,
                   "of spheres: fill what opens between segments that turn against each other, halfway "
                   "between them (the default); --no-bridge fills as Gagvani and Silver 2001 do");
}

}  // namespace ecorche::app
