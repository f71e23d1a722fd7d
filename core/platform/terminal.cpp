// SPDX-License-Identifier: Apache-2.0
#include "core/platform/terminal.hpp"

#include <unistd.h>

namespace ecorche::platform {

bool stderr_is_terminal() {
  return isatty(STDERR_FILENO) == 1;
}

bool stdout_is_terminal() {
  return isatty(STDOUT_FILENO) == 1;
}

}  // namespace ecorche::platform
