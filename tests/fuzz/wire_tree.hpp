// SPDX-License-Identifier: Apache-2.0
// A Protobuf message as a tree of its fields, without its schema: the small Protobuf has no reflection.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ecorche::fuzz {

/// A field. What has a length is a message of its own where it reads as one, else bytes.
struct WireField {
  enum class Kind : std::uint8_t { varint = 0, fixed64 = 1, length = 2, fixed32 = 5 };

  std::uint32_t number = 1;  ///< from 1
  Kind kind = Kind::varint;
  std::uint64_t value = 0;                         ///< of varint, fixed32 and fixed64
  std::string bytes{};                             ///< of length, where it is no message
  std::optional<std::vector<WireField>> fields{};  ///< of length, where it is one
};

using WireTree = std::vector<WireField>;

/// The fields of `bytes`; nothing where they are no message, or hold groups, which this protocol has not.
std::optional<WireTree> parse_wire(std::string_view bytes);

/// What parse_wire reads again; lengths are as they must be.
std::string write_wire(const WireTree& tree);

}  // namespace ecorche::fuzz
