// SPDX-License-Identifier: Apache-2.0
// Numbers as OpenIGTLink writes them: the highest byte first, float32 by its bits.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ecorche::app::igtl {

/// `sizeof(T)` bytes at `from`.
template <class T>
T load_big(const std::byte* from) {
  if constexpr (std::is_same_v<T, float>) {
    return std::bit_cast<float>(load_big<std::uint32_t>(from));
  } else {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      value = (value << 8) | std::to_integer<std::uint64_t>(from[i]);
    return static_cast<T>(value);
  }
}

/// `sizeof(T)` bytes to `to`.
template <class T>
void store_big(T value, std::byte* to) {
  if constexpr (std::is_same_v<T, float>) {
    store_big(std::bit_cast<std::uint32_t>(value), to);
  } else {
    const auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i)
      to[i] = static_cast<std::byte>(bits >> (8 * (sizeof(T) - 1 - i)));
  }
}

}  // namespace ecorche::app::igtl
