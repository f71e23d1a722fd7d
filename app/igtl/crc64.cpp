// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/crc64.hpp"

#include <array>

#include "app/igtl/big_endian.hpp"

namespace ecorche::app::igtl {
namespace {

constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;

// Row k: what a byte does that is followed by k more.
using CrcTables = std::array<std::array<std::uint64_t, 256>, 8>;

constexpr CrcTables make_crc_tables() {
  CrcTables out{};
  for (std::uint64_t byte = 0; byte < 256; ++byte) {
    std::uint64_t crc = byte << 56;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc >> 63) != 0 ? kPolynomial : 0);
    out[0][byte] = crc;
  }
  for (std::size_t row = 1; row < out.size(); ++row) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint64_t before = out[row - 1][byte];
      out[row][byte] = (before << 8) ^ out[0][before >> 56];
    }
  }
  return out;
}

constexpr CrcTables kCrcTables = make_crc_tables();

}  // namespace

std::uint64_t crc64(std::span<const std::byte> bytes) {
  std::uint64_t crc = 0;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    const std::uint64_t mixed = crc ^ load_big<std::uint64_t>(bytes.data());
    crc = 0;
    for (std::size_t row = 0; row < 8; ++row) crc ^= kCrcTables[row][(mixed >> (8 * row)) & 255];
  }
  for (const std::byte byte : bytes)
    crc = (crc << 8) ^ kCrcTables[0][(crc >> 56) ^ std::to_integer<std::uint64_t>(byte)];
  return crc;
}

}  // namespace ecorche::app::igtl
