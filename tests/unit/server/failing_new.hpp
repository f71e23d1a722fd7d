// SPDX-License-Identifier: Apache-2.0
// An operator new that fails when it is told to: for executables of their own.
#pragma once

#include "tests/unit/server/faults.hpp"

namespace ecorche::server {

/// The allocation that fails, counted where a thread handles something.
extern Countdown allocations;
extern thread_local bool handling;

}  // namespace ecorche::server
