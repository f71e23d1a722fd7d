// SPDX-License-Identifier: Apache-2.0
// What is refused of a command line before anything is read.
#pragma once

#include <string>

#include <ecorche/values/error.hpp>

namespace ecorche::app {

/// Throws Error{usage}. `where`: the option, or the file that it names.
[[noreturn]] inline void usage_error(const std::string& where, const std::string& what,
                                     const std::string& mend) {
  throw Error(ErrorKind::usage, where, what, mend);
}

}  // namespace ecorche::app
