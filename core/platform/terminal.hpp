// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ecorche::platform {

/// Whether a person reads stderr as it is written.
bool stderr_is_terminal();
/// As of stdout.
bool stdout_is_terminal();

}  // namespace ecorche::platform
