// SPDX-License-Identifier: Apache-2.0
// Lines of a report, as std::printf formats them.
#pragma once

#include <cstdio>
#include <string>

namespace ecorche::app {

/// At most 511 characters, and the end of the line.
template <class... Values>
std::string text_line(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return std::string(buffer) + "\n";
}

}  // namespace ecorche::app
