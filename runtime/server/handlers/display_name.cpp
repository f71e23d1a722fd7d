// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/handlers/display_name.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/values/text.hpp"
#include "core/values/utf8.hpp"

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

}  // namespace

std::string display_name(std::string_view text) {
  std::string name;
  std::size_t characters = 0;
  text = text::trim(text);
  while (!text.empty() && characters < kMostCharacters) {
    const auto [character, size] = text::first_character(text);
    if (size > 0 && !controls(character)) {
      name += text.substr(0, size);
      ++characters;
    }
    text.remove_prefix(size > 0 ? size : 1);
  }
  return std::string(text::trim(name));
}

}  // namespace ecorche::server
