// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <system_error>

namespace ecorche::platform {

/// What the last call of the system failed with.
inline std::error_code last_error() {
  return {errno, std::generic_category()};
}

}  // namespace ecorche::platform
