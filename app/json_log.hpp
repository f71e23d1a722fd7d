// SPDX-License-Identifier: Apache-2.0
// The log as JSON, an object a line.
#pragma once

#include "runtime/server/resources/journal.hpp"

namespace ecorche::app {

/// From now on spdlog's lines are
///
///     {"time":"2026-01-15T09:12:44.103Z","level":"info","connection":17,"peer":"10.0.0.7:51514",
///      "token":"ward_3","session":"ward_3","message":"dropped: stopped reading"}
///
/// each on one line, without what is not known; UTC.
void log_as_json();

/// Where the server's lines go, so that what they are about is told field by field.
server::Journal::Write json_lines();

}  // namespace ecorche::app
