// SPDX-License-Identifier: Apache-2.0
// Words and numbers of ASCII text, the same in every locale: files do not change with the user's language.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche::text {

constexpr bool is_space(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

constexpr char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}
std::string lower(std::string_view text);

/// Without the spaces at both ends.
inline std::string_view trim(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// The next word of `text`, cut off it; empty at the end.
inline std::string_view cut_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_space(text[begin])) ++begin;
  std::size_t end = begin;
  while (end < text.size() && !is_space(text[end])) ++end;
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

/// What stands between spaces. They point into `text`.
std::vector<std::string_view> words(std::string_view text);

/// `a, b, c`.
template <class Items>
std::string joined(const Items& items, std::string_view between = ", ") {
  std::string out;
  bool first = true;
  for (const std::string_view item : items) {
    if (!first) out += between;
    out += item;
    first = false;
  }
  return out;
}

/// With at most so many significant digits, as "%.3g" prints it.
std::string number(double value, int digits = 3);

/// The shortest text that reads back as the same number.
std::string shortest(double value);

/// 16 digits.
std::string hex(std::uint64_t value);

}  // namespace ecorche::text
