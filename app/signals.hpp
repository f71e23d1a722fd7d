// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>

namespace ecorche::app {

/// A token that SIGINT and SIGTERM set; a second signal ends the process at once. Call once, before any
/// thread starts: both signals are blocked in every thread and awaited in one of their own.
std::stop_token stop_on_signals();

}  // namespace ecorche::app
