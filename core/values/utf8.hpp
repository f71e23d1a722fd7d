// SPDX-License-Identifier: Apache-2.0
// Characters of foreign text, which may be no text at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace ecorche::text {

/// The character that begins `text`, which is not empty, and its bytes; {0, 0} where those are no UTF-8
/// (RFC 3629: neither longer than need be, nor half of a surrogate pair, nor beyond U+10FFFF).
std::pair<std::uint32_t, std::size_t> first_character(std::string_view text);

/// As one line of UTF-8: a control character becomes a blank, and a byte that is no UTF-8 a question mark.
std::string one_line(std::string_view text);

}  // namespace ecorche::text
