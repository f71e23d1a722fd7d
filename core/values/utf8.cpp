// SPDX-License-Identifier: Apache-2.0
#include "core/values/utf8.hpp"

namespace ecorche::text {

std::pair<std::uint32_t, std::size_t> first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  const std::size_t size = lead < 0x80   ? 1
                           : lead < 0xC2 ? 0
                           : lead < 0xE0 ? 2
                           : lead < 0xF0 ? 3
                           : lead < 0xF5 ? 4
                                         : 0;
  if (size == 0 || size > text.size()) return {0, 0};
  std::uint32_t character = size == 1 ? lead : lead & (0x7FU >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {0, 0};
    character = character << 6U | (byte(i) & 0x3FU);
  }
  const bool too_long = (size == 3 && character < 0x800) || (size == 4 && character < 0x10000);
  const bool surrogate = character >= 0xD800 && character <= 0xDFFF;
  if (too_long || surrogate || character > 0x10FFFF) return {0, 0};
  return {character, size};
}

std::string one_line(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const auto [character, size] = first_character(text);
    const bool controls = character < 0x20 || (character >= 0x7F && character < 0xA0);
    if (size == 0) {
      line += '?';
    } else if (controls) {
      line += ' ';
    } else {
      line += text.substr(0, size);
    }
    text.remove_prefix(size > 0 ? size : 1);
  }
  return line;
}

}  // namespace ecorche::text
