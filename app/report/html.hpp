// SPDX-License-Identifier: Apache-2.0
// Text for pages.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace ecorche::app::report {

/// Anything as the text of a page: markup escaped, control bytes and broken UTF-8 replaced.
std::string escaped(std::string_view text);

/// printf into a string.
template <class... Values>
std::string text(const char* format, const Values&... values) {
  const int length = std::snprintf(nullptr, 0, format, values...);
  std::string out(static_cast<std::size_t>(length) + 1, '\0');
  std::snprintf(out.data(), out.size(), format, values...);
  out.pop_back();
  return out;
}

}  // namespace ecorche::app::report
