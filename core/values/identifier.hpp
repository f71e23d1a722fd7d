// SPDX-License-Identifier: Apache-2.0
// The names that a case, a model and the wire share.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ecorche {

constexpr std::size_t longest_identifier = 64;

constexpr bool in_identifier(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
}

/// Whether `name` is `[a-z0-9_]{1,64}`.
bool is_identifier(std::string_view name);

/// A name as people write it made into an identifier, `[a-z0-9_]{0,longest}`: letters become small, every run
/// of anything else but digits one `_`, none at either end. Empty where nothing is left.
std::string identifier_from(std::string_view name, std::size_t longest = longest_identifier);

}  // namespace ecorche
