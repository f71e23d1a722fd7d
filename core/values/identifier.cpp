// SPDX-License-Identifier: Apache-2.0
#include "core/values/identifier.hpp"

#include <algorithm>

#include "core/values/text.hpp"

namespace ecorche {

bool is_identifier(std::string_view name) {
  return !name.empty() && name.size() <= longest_identifier &&
         std::all_of(name.begin(), name.end(), in_identifier);
}

std::string identifier_from(std::string_view name, std::size_t longest) {
  std::string out;
  for (const char written : name) {
    const char c = text::lower(written);
    if (in_identifier(c) && c != '_') {
      out += c;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  out.resize(std::min(out.size(), longest));
  while (out.ends_with('_')) out.pop_back();
  return out;
}

}  // namespace ecorche
