// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/display_name.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/values/text.hpp"

namespace ecorche::server {
namespace {

constexpr std::size_t kMostCharacters = 64;

// First and last: controls, the soft hyphen, Arabic and Mongolian marks, widths and directions, separators of
// lines, invisible operators, variation selectors, the byte order mark, annotations, tags.
constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 12> kControls{{{0x00, 0x1F},
                                                                             {0x7F, 0x9F},
                                                                             {0xAD, 0xAD},
                                                                             {0x61C, 0x61C},
                                                                             {0x180B, 0x180F},
                                                                             {0x200B, 0x200F},
                                                                             {0x2028, 0x202E},
                                                                             {0x2060, 0x206F},
                                                                             {0xFE00, 0xFE0F},
                                                                             {0xFEFF, 0xFEFF},
                                                                             {0xFFF0, 0xFFFF},
                                                                             {0xE0000, 0xE0FFF}}};

bool controls(std::uint32_t character) {
  for (const auto& [first, last] : kControls) {
    if (character >= first && character <= last) return true;
  }
  return false;
}

// The character that begins `text`, and its bytes; none of those where it is no UTF-8.
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
  return {character, size};
}

}  // namespace

std::string display_name(std::string_view text) {
  std::string name;
  std::size_t characters = 0;
  text = text::trim(text);
  while (!text.empty() && characters < kMostCharacters) {
    const auto [character, size] = first_character(text);
    if (size > 0 && !controls(character)) {
      name += text.substr(0, size);
      ++characters;
    }
    text.remove_prefix(size > 0 ? size : 1);
  }
  return std::string(text::trim(name));
}

}  // namespace ecorche::server
