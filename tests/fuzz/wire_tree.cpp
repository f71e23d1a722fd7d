// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/wire_tree.hpp"

#include <cstring>

namespace ecorche::fuzz {
namespace {

constexpr int kDeepest = 12;

bool cut_varint(std::string_view& bytes, std::uint64_t& value) {
  value = 0;
  for (unsigned shift = 0; shift < 64 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<std::uint8_t>(bytes.front());
    bytes.remove_prefix(1);
    value |= std::uint64_t{byte & 0x7FU} << shift;
    if (byte < 0x80) return true;
  }
  return false;
}

bool cut_fixed(std::string_view& bytes, std::size_t width, std::uint64_t& value) {
  if (bytes.size() < width) return false;
  value = 0;
  std::memcpy(&value, bytes.data(), width);
  bytes.remove_prefix(width);
  return true;
}

std::optional<WireTree> parse(std::string_view bytes, int depth) {
  WireTree tree;
  while (!bytes.empty()) {
    std::uint64_t tag = 0, length = 0;
    if (!cut_varint(bytes, tag) || tag >> 3U == 0 || tag >> 3U >= 1U << 29U) return std::nullopt;
    WireField field{.number = static_cast<std::uint32_t>(tag >> 3U),
                    .kind = static_cast<WireField::Kind>(tag & 7U)};
    switch (field.kind) {
      case WireField::Kind::varint:
        if (!cut_varint(bytes, field.value)) return std::nullopt;
        break;
      case WireField::Kind::fixed64:
        if (!cut_fixed(bytes, 8, field.value)) return std::nullopt;
        break;
      case WireField::Kind::fixed32:
        if (!cut_fixed(bytes, 4, field.value)) return std::nullopt;
        break;
      case WireField::Kind::length:
        if (!cut_varint(bytes, length) || length > bytes.size()) return std::nullopt;
        field.bytes = bytes.substr(0, length);
        bytes.remove_prefix(length);
        if (depth < kDeepest) field.fields = parse(field.bytes, depth + 1);
        if (field.fields) field.bytes.clear();
        break;
      default:
        return std::nullopt;
    }
    tree.push_back(std::move(field));
  }
  return tree;
}

void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7U) out += static_cast<char>(value | 0x80U);
  out += static_cast<char>(value);
}

}  // namespace

std::optional<WireTree> parse_wire(std::string_view bytes) {
  return parse(bytes, 0);
}

std::string write_wire(const WireTree& tree) {
  std::string out;
  for (const WireField& field : tree) {
    append_varint(out, std::uint64_t{field.number} << 3U | static_cast<std::uint64_t>(field.kind));
    if (field.kind == WireField::Kind::varint) {
      append_varint(out, field.value);
    } else if (field.kind == WireField::Kind::length) {
      const std::string inner = field.fields ? write_wire(*field.fields) : field.bytes;
      append_varint(out, inner.size());
      out += inner;
    } else {
      out.append(reinterpret_cast<const char*>(&field.value), field.kind == WireField::Kind::fixed64 ? 8 : 4);
    }
  }
  return out;
}

}  // namespace ecorche::fuzz
