// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>

namespace ecorche::app {

/// A token that SIGINT and SIGTERM set; a second signal ends the process at once. Call once. Both get a
/// handler, whatever thread they reach: libraries start threads while they are loaded (OpenBLAS), in which
/// blocked signals would not be. A signal that the process was told to ignore stays ignored.
std::stop_token stop_on_signals();

}  // namespace ecorche::app
